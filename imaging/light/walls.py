"""Where on a curved surface light is told: all facets that go around one axis together, however many they are.

Nodes go around the axis and along the profile, so that a bore has the same ones whatever its facets are. Those that lie
where the surface is cut off stand at the nearest place of it. Other curved surfaces are told facet by facet.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from imaging.light.annulus import nodes_around
from imaging.light.nodes import along
from scenes import Solid
from scenes.parts.shading import corner_normals
from scenes.parts.surfaces import axes_beside

_LEAST_FACETS = 4
_ROUND = 0.05  # rad: rms of how far normals miss the axis; corners at which a surface ends have half a facet's turn
_SHIFTED = 0.1  # of a motion: it turns by less, as one along a column does
_THIN = 1e-3  # of the largest radius: nearer to the axis there is no angle
_FOLDED = 1e-3  # of all that it covers, what lies upon other parts of it, around the axis and along the profile
_GAP = 1e-6  # rad: what is nearer to a whole turn is one
_WITHIN = 0.01  # of the way: nodes stand off the rim, where light comes from both sides
_NO_SIDE = 1e-300  # squared length
_AT_ONCE = 1 << 18  # pairs of nodes and triangles


@dataclass(frozen=True, eq=False)
class Wall:
    """A surface around an axis, unrolled.

    Attributes
    ----------
    point, axis : ndarray, shape (3,)
        Of the axis.
    slant : ndarray, shape (2,)
        Unit vector along the profile, along the axis and away from it.
    begin, turn : float
        Angle at which it begins and how far it goes around, rad.
    low, length : float
        Along the profile.
    triangles : ndarray, shape (T, 3, 3)
        Of its facets.
    faces : ndarray of int, shape (T,)
        The facet of each.
    count : int
        Nodes around.
    rows : ndarray
        Nodes along the profile, from its end.
    """

    point: np.ndarray
    axis: np.ndarray
    slant: np.ndarray
    begin: float
    turn: float
    low: float
    length: float
    triangles: np.ndarray
    faces: np.ndarray
    count: int
    rows: np.ndarray

    @property
    def closed(self) -> bool:
        """Whether it goes around whole."""
        return self.turn == 2 * np.pi

    @property
    def size(self) -> np.ndarray:
        """Of the coordinates, (2,)."""
        return np.array([self.count, self.length])

    def coordinates(self, points: np.ndarray) -> np.ndarray:
        """Of points (n, 3) of it: steps around the axis and along the profile, (n, 2)."""
        angle, profile = _unrolled(points, self.point, self.axis, self.slant)
        step = (angle - self.begin) % (2 * np.pi) / self.turn * self.count - 0.5
        if self.closed:
            step %= self.count
        else:  # from the middle of the gap on the beginning is nearer
            gap = (2 * np.pi / self.turn - 1) * self.count
            step = np.where(step > self.count + gap / 2, 0.0, np.clip(step, 0, self.count - 1))
        return np.stack([step, np.clip(profile - self.low, 0, self.length)], -1)

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Places (n, 3) and their facets (n,), from row to row, then around."""
        step = self.turn / self.count
        within = _WITHIN * self.rows[1]
        angle = (np.arange(self.count) + 0.5) * step
        profile = np.clip(self.rows, within, self.length - within)
        asked = np.stack(np.meshgrid(angle, profile, indexing="ij"), -1).reshape(-1, 2) * [self._wide, 1.0]
        which, share = _nearest(self._flat, asked)
        which %= len(self.faces)
        return np.einsum("nk,nki->ni", share, self.triangles[which]), self.faces[which]

    @cached_property
    def _wide(self) -> float:
        """Mean radius."""
        return float(_away(self.triangles, self.point, self.axis).mean())

    @cached_property
    def _flat(self) -> np.ndarray:
        """Its triangles laid flat, (T, 3, 2), about as long as they are; of a whole turn one before and after, too."""
        angle, profile = _unrolled(self.triangles, self.point, self.axis, self.slant)
        flat = np.stack([_onward(angle, self.begin) * self._wide, profile - self.low], -1)
        turns = np.array([[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0]]) * 2 * np.pi * self._wide
        return (flat + turns[: 3 if self.closed else 1, None, None]).reshape(-1, 3, 2)


@lru_cache(maxsize=1024)
def wall(solid: Solid, region: int, cell: float) -> Wall | None:
    """Of one of a solid's curved surfaces, told in cells of some side; None where it goes around no axis, or comes back
    over itself."""
    here = np.isin(solid.triangle_faces, np.flatnonzero((solid.regions == region) & ~solid.plane))
    triangles, faces = solid.triangles[here], solid.triangle_faces[here]
    if np.unique(faces).size < _LEAST_FACETS:
        return None
    found = _axis(triangles.reshape(-1, 3), corner_normals(solid)[here].reshape(-1, 3))
    if found is None:
        return None
    slant = _slant(triangles, *found)
    angle, profile = _unrolled(triangles, *found, slant)
    (begin, turn), low, length = _around(angle), float(profile.min()), float(np.ptp(profile))
    if length <= 0 or _is_folded(np.stack([_onward(angle, begin), profile], -1), turn * length):
        return None
    count, rows = nodes_around(turn, _away(triangles, *found).max(), cell), along(length, False, cell)
    return Wall(*found, slant, begin, turn, low, length, triangles, faces, count, rows)


def _axis(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """A point (3,) and the direction (3,) of a line that all normals (n, 3) at points (n, 3) meet; None without one.

    A turn about a line moves the points along the surface, across the normals: of linear combinations of turns and
    shifts that do, the one that is a turn alone (Pottmann and Wallner 2001, "Computational Line Geometry").
    """
    middle = points.mean(0)
    size = np.linalg.norm(points - middle, axis=1).max()
    away = (points - middle) / size
    rows = np.concatenate([np.cross(away, normals), normals], 1)
    _, sizes, ways = np.linalg.svd(rows.T @ rows / len(rows))
    kept = ways[np.sqrt(sizes) < _ROUND]
    if not len(kept):
        return None
    motion = np.linalg.svd(kept[:, :3])[0][:, 0] @ kept  # that which turns most: it shifts along no axis
    size_of_turn = np.linalg.norm(motion[:3])
    if size_of_turn < _SHIFTED:
        return None
    axis = motion[:3] / size_of_turn
    point = np.cross(axis, motion[3:] / size_of_turn)
    missed = np.einsum("ni,ni->n", np.cross(axis, away - point), normals)
    far = np.linalg.norm(np.cross(axis, away - point), axis=1)
    if far.min() < _THIN * far.max() or np.sqrt((missed**2).mean()) > _ROUND * far.max():
        return None
    return middle + size * point, axis


def _slant(triangles: np.ndarray, point: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Unit vector (2,) along the profile of most extent, along the axis and away from it."""
    points = triangles.reshape(-1, 3)
    profile = np.stack([(points - point) @ axis, _away(points, point, axis)], -1)
    return np.linalg.svd(profile - profile.mean(0), full_matrices=False)[2][0]


def _away(points: np.ndarray, point: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Distance of points (..., 3) from an axis, (...)."""
    return np.linalg.norm(np.cross(points - point, axis), axis=-1)


def _unrolled(
    points: np.ndarray, point: np.ndarray, axis: np.ndarray, slant: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Angles around an axis and places along the profile of points (..., 3)."""
    one, two = axes_beside(axis)
    away = points - point
    x, y = away @ one, away @ two
    return np.arctan2(y, x), away @ axis * slant[0] + np.hypot(x, y) * slant[1]


def _around(angle: np.ndarray) -> tuple[float, float]:
    """Where triangles of such angles (T, 3) begin around the axis, and how far they go."""
    first = angle[:, :1]
    turned = (angle - first + np.pi) % (2 * np.pi) - np.pi
    starts = (first[:, 0] + turned.min(1)) % (2 * np.pi)
    order = np.argsort(starts)
    starts, ends = starts[order], starts[order] + np.ptp(turned, axis=1)[order]
    reached = np.maximum.accumulate(ends)
    before = np.append(max(reached[-1] - 2 * np.pi, -np.inf), reached[:-1])
    gaps = starts - before
    widest = gaps.argmax()
    if gaps[widest] <= _GAP:
        return 0.0, 2 * np.pi
    return float(starts[widest]), float(2 * np.pi - gaps[widest])


def _onward(angle: np.ndarray, begin: float) -> np.ndarray:
    """Angles (T, 3) of triangles from a beginning on, none of them cut in two."""
    turned = (angle - angle[:, :1] + np.pi) % (2 * np.pi) - np.pi
    found = angle[:, :1] - begin + turned
    return found - 2 * np.pi * np.floor(found.mean(1, keepdims=True) / (2 * np.pi))


def _is_folded(flat: np.ndarray, whole: float) -> bool:
    """Whether triangles (T, 3, 2) laid flat cover something twice, within a rectangle of some area."""
    one, two = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    areas = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2
    areas = areas * np.sign(areas.sum())
    return bool(-areas[areas < 0].sum() > _FOLDED * areas.sum() or areas.sum() > (1 + _FOLDED) * whole)


def _nearest(flat: np.ndarray, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of triangles (T, 3, 2) that which each of places (n, 2) is in or nearest to, and the shares of its corners (n, 3)
    at the nearest place in it, (n,) and (n, 3)."""
    which, share = np.empty(len(asked), int), np.empty((len(asked), 3))
    many = max(1, _AT_ONCE // len(flat))
    for at in range(0, len(asked), many):
        part = slice(at, at + many)
        which[part], share[part] = _nearest_of(flat, asked[part])
    return which, share


def _nearest_of(flat: np.ndarray, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    ways, out = np.roll(flat, -1, 1) - flat, asked[:, None, None] - flat  # of the sides, from their first corners
    along = np.clip((out * ways).sum(-1) / np.maximum((ways**2).sum(-1), _NO_SIDE), 0, 1)
    off2 = ((out - along[..., None] * ways) ** 2).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):  # triangles of no area
        shares = np.roll(_cross(ways, out) / _cross(ways[:, 0], -ways[:, 2])[:, None], 2, -1)
    inside = (shares >= 0).all(-1)
    which, row = np.where(inside, -1.0, off2.min(-1)).argmin(1), np.arange(len(asked))
    side = off2[row, which].argmin(-1)
    beside = np.zeros((len(asked), 3))
    beside[row, side], beside[row, (side + 1) % 3] = 1 - along[row, which, side], along[row, which, side]
    beside += _WITHIN * (1 / 3 - beside)
    return which, np.where(inside[row, which, None], shares[row, which], beside)


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Of vectors (..., 2)."""
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]
