"""Light that the walls and shoulders of a turned part send to each other, by radiosity, and what they keep from it.

Form factors between two rings about the axis depend on the difference of the angles alone, and so does what stands
between them; sums around the axis are convolutions. Light of the second and later bounces is added until it is small.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from imaging.geometry.rays import first_face
from imaging.light.emitters import Emitter, emitters
from imaging.light.illumination import dimming_of_one
from imaging.light.irradiance import beam
from imaging.pictures import Pictures
from scenes import Curved, Scene, Solid
from scenes.lights import GLANCE
from scenes.parts.surfaces import axes_beside
from scenes.parts.surfaces.ruled import Ruled

if TYPE_CHECKING:
    from scipy.interpolate import RectBivariateSpline

_ON_WALL, _ON_SHOULDER, _AROUND = 20, 10, 64  # rings, and places on a ring
_FINE = 5  # places in one of them, around, over which a form factor is summed
_PIECES = 8  # of a cone, at whose ends it is asked whether a line passes beside it
_SAME = 1e-6  # of the part's size
_BOUNCES = 6


@dataclass(frozen=True, eq=False)
class Rings:
    """R rings of a turned part, in heights z along its axis from the first wall's point and distances r from it.

    Attributes
    ----------
    z, r, upward, outward, area : ndarray, shape (R,)
        Middles of the rings, their normals' parts along and away from the axis, and areas.
    of_wall : dict of str to slice
        The rings of each wall.
    own : tuple of tuple of int
        The facets that stand for each ring's surface.
    profile : ndarray, shape (m, 2)
        Heights and radii of the ends of all walls, and of places between those of cones.
    axes : ndarray, shape (3, 3)
        Rows: two across the axis, and the axis.
    origin : ndarray, shape (3,)
    """

    z: np.ndarray
    r: np.ndarray
    upward: np.ndarray
    outward: np.ndarray
    area: np.ndarray
    of_wall: dict[str, slice]
    own: tuple[tuple[int, ...], ...]
    profile: np.ndarray
    axes: np.ndarray
    origin: np.ndarray

    @property
    def places(self) -> np.ndarray:
        """In space, shape (R, angles, 3)."""
        return self.origin + self.r[:, None, None] * self.spokes + self.z[:, None, None] * self.axes[2]

    @property
    def normals(self) -> np.ndarray:
        """Shape (R, angles, 3)."""
        return self.outward[:, None, None] * self.spokes + self.upward[:, None, None] * self.axes[2]

    @property
    def spokes(self) -> np.ndarray:
        """Unit vectors away from the axis, shape (angles, 3)."""
        return np.cos(_ANGLES)[:, None] * self.axes[0] + np.sin(_ANGLES)[:, None] * self.axes[1]


_ANGLES = 2 * np.pi * np.arange(_AROUND) / _AROUND


def light_around(pictures: Pictures, curved: Curved, points: np.ndarray) -> np.ndarray | float:
    """Signal that points (..., 3) of a wall have from the other walls and the shoulders; diffuse light alone.

    0 in pictures that are not looked at closely, and where the part is not one of outer walls about one axis.
    """
    scene = pictures.scene
    if not pictures.closely or scene.solid.is_convex:
        return 0.0
    rings = rings_of(scene.solid)
    if rings is None:
        return 0.0
    told = pictures.once(("around", curved.name), lambda: _told(pictures, rings, curved.name))
    away = points - rings.origin
    angle = np.arctan2(away @ rings.axes[1], away @ rings.axes[0]) % (2 * np.pi)
    white = scene.surfaces.of(curved.faces[0]).diffuse(scene.camera.analyser_deg is not None)
    found = scene.camera.exposure * white * np.maximum(told.ev(away @ rings.axes[2], angle), 0.0)
    return found * dimming_of_one(pictures, points)


def passes(rings: Rings, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Whether the part leaves the way free from places (..., 3) on it, away from the surface there, to others."""
    return _passes(rings, (start - rings.origin) @ rings.axes.T, (stop - rings.origin) @ rings.axes.T)


def _passes(rings: Rings, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """The same in the part's own axes: a line away from a wall gets ever farther from the axis, so walls' ends tell."""
    start, stop = np.broadcast_arrays(start, stop)
    way, near = stop - start, _SAME * float(np.abs(rings.profile).max())
    free = np.ones(start.shape[:-1], bool)
    with np.errstate(divide="ignore", invalid="ignore"):
        for height, radius in rings.profile:
            share = (height - start[..., 2]) / way[..., 2]
            x, y = start[..., 0] + share * way[..., 0], start[..., 1] + share * way[..., 1]
            inside = x * x + y * y < (radius - near) ** 2
            free &= ~(inside & (share > 0) & (share < 1))
    return free


class _Stretch(NamedTuple):
    """A wall in heights along the first one's axis: (z, r) of its lower and of its upper end."""

    wall: Curved
    low: tuple[float, float]
    high: tuple[float, float]


@lru_cache(maxsize=16)
def rings_of(solid: Solid) -> Rings | None:
    """The rings of a part of outer walls that follow each other along one axis, and nothing else; None of any other."""
    walls = [each for each in solid.curved if isinstance(each.surface, Ruled) and not each.surface.hollow]
    if not walls or len(walls) < len(solid.curved) or not _is_turned(solid):
        return None
    origin, axis, near = walls[0].surface.point, walls[0].surface.axis, _SAME * solid.extent
    found = sorted((_stretch(wall, wall.surface, origin, axis) for wall in walls), key=lambda each: each.low)
    if any(abs(a.high[0] - b.low[0]) > near for a, b in pairwise(found)):
        return None
    rows, of_wall, own, count = [], {}, [], 0
    for each, following in zip(found, [*found[1:], None], strict=True):
        rows.append(_cells(each.low, each.high, _ON_WALL))
        of_wall[each.wall.name] = slice(count, count + _ON_WALL)
        own += [each.wall.faces] * _ON_WALL
        count += _ON_WALL
        if following is not None and abs(following.low[1] - each.high[1]) > near:
            rows.append(_cells(each.high, (each.high[0], following.low[1]), _ON_SHOULDER))
            own += [_shoulder(solid, origin + each.high[0] * axis, axis, near)] * _ON_SHOULDER
            count += _ON_SHOULDER
    profile = [_ends(each.low, each.high) for each in found]
    axes = np.stack([*axes_beside(axis), axis])
    return Rings(*np.concatenate(rows, 1), of_wall, tuple(own), np.concatenate(profile), axes, origin)


def _is_turned(solid: Solid) -> bool:
    """Whether the walls are about one axis, and all that is no facet of theirs is plane and across it."""
    first, near = solid.curved[0].surface, _SAME * solid.extent
    for each in solid.curved:
        away = each.surface.point - first.point
        if np.linalg.norm(np.cross(away, first.axis)) > near or abs(each.surface.axis @ first.axis) < 1 - _SAME:
            return False
    rest = np.ones(len(solid.faces), bool)
    rest[[face for each in solid.curved for face in each.faces]] = False
    return bool((np.abs(solid.normals[rest] @ first.axis) > 1 - _SAME).all())


def _stretch(wall: Curved, surface: Ruled, origin: np.ndarray, axis: np.ndarray) -> _Stretch:
    middle, sign = float((surface.point - origin) @ axis), 1.0 if surface.axis @ axis > 0 else -1.0
    ends = sorted((middle + sign * end, surface.radius + surface.slope * end) for end in surface.ends)
    return _Stretch(wall, *ends)


def _ends(low: tuple[float, float], high: tuple[float, float]) -> np.ndarray:
    """Two places (z, r) and, of a cone, some between them, (k, 2)."""
    share = np.linspace(0, 1, 2 if low[1] == high[1] else _PIECES + 1)[:, None]
    return np.array(low) + share * (np.array(high) - np.array(low))


def _cells(low: tuple[float, float], high: tuple[float, float], count: int) -> np.ndarray:
    """Rings between two places (z, r) of the profile, narrow towards both: middles z and r, normals, areas, (5, n)."""
    share = (1 - np.cos(np.pi * np.linspace(0, 1, count + 1))) / 2
    (z0, r0), (z1, r1) = low, high
    length = np.hypot(z1 - z0, r1 - r0)
    middle = (share[1:] + share[:-1]) / 2
    radius = r0 + middle * (r1 - r0)
    ones = np.ones(count)
    area = 2 * np.pi * radius * np.diff(share) * length
    return np.stack([z0 + middle * (z1 - z0), radius, -(r1 - r0) / length * ones, (z1 - z0) / length * ones, area])


def _shoulder(solid: Solid, centre: np.ndarray, axis: np.ndarray, near: float) -> tuple[int, ...]:
    """Plane faces across the axis at a place of it."""
    flat = np.abs(solid.normals @ axis) > 1 - _SAME
    level = np.array([np.abs((solid.vertices[list(face)] - centre) @ axis).max() <= near for face in solid.faces])
    return tuple(np.flatnonzero(flat & level).tolist())


@lru_cache(maxsize=16)
def _factors(rings: Rings) -> np.ndarray:
    """Fourier transform around the axis of the form factors from each ring's place to places of each, (R, R, k)."""
    fine = _AROUND * _FINE
    angle = 2 * np.pi * (np.arange(fine) - _FINE // 2) / fine
    turn, level = np.stack([np.cos(angle), np.sin(angle)], -1), np.ones((fine, 1))
    stop, there = (
        np.concatenate([flat[:, None, None] * turn, upright[:, None, None] * level], -1)
        for flat, upright in ((rings.r, rings.z), (rings.outward, rings.upward))
    )
    found = np.zeros((len(rings.r), len(rings.r), _AROUND))
    for i, (r, z) in enumerate(zip(rings.r, rings.z, strict=True)):
        way = stop - np.array([r, 0.0, z])
        square = (way**2).sum(-1)
        square[square == 0] = np.inf  # a place itself
        leaving = np.maximum(way @ np.array([rings.outward[i], 0.0, rings.upward[i]]), 0.0)
        arriving = np.maximum(-(way * there).sum(-1), 0.0)
        each = leaving * arriving / (np.pi * square**2) * (rings.area / fine)[:, None]
        each = np.where(each > 0, each * _passes(rings, np.array([r, 0.0, z]), stop), 0.0)
        found[i] = each.reshape(len(rings.r), _AROUND, _FINE).sum(-1)
    found /= np.maximum(found.sum((1, 2)), 1.0)[:, None, None]  # in an inner edge cells are no points
    return np.fft.rfft(found, axis=-1)


def _told(pictures: Pictures, rings: Rings, name: str) -> RectBivariateSpline:
    """Light that arrives at a wall from elsewhere on the part, by height and angle."""
    scene = pictures.scene
    analysed = scene.camera.analyser_deg is not None
    white = np.array([scene.surfaces.of(faces[0]).diffuse(analysed) if faces else 0.0 for faces in rings.own])
    direct = sum(_direct(scene, rings, each) for each in emitters(scene, pictures.lights, GLANCE))
    factors, arriving = _factors(rings), np.zeros_like(direct)
    for _ in range(_BOUNCES):
        sent = np.fft.rfft(white[:, None] * (direct + arriving), axis=-1)
        arriving = np.fft.irfft(np.einsum("ijk,jk->ik", factors.conj(), sent), _AROUND, axis=-1)
    part = rings.of_wall[name]
    angles = np.concatenate([_ANGLES[-3:] - 2 * np.pi, _ANGLES, _ANGLES[:4] + 2 * np.pi])
    values = np.concatenate([arriving[part, -3:], arriving[part], arriving[part, :4]], 1)
    from scipy.interpolate import RectBivariateSpline  # takes a tenth of a second to load

    return RectBivariateSpline(rings.z[part], angles, values)


def _direct(scene: Scene, rings: Rings, emitter: Emitter) -> np.ndarray:
    """Irradiance of the rings by one emitter, where nothing stands before it, shape (R, angles)."""
    places, normals = rings.places, rings.normals
    arriving = beam(emitter, places)
    found = arriving.strength * np.maximum((normals * arriving.to_light).sum(-1), 0.0)
    at = np.asarray(emitter.at, float).reshape(3)
    for own in dict.fromkeys(rings.own):
        here = np.array([each == own for each in rings.own])[:, None] & (found > 0)
        start = np.broadcast_to(at, places[here].shape)
        _, t = first_face(scene.bodies, start, places[here] - start, own)
        found[here] = np.where(t > 1 - _SAME, found[here], 0.0)
    return found
