"""Where in a picture a part lies: edges of the picture against those that its model would show, from coarse to fine.

First all shifts and turns of the plausible range are tried against a map of how near the next edge of about the same
direction is (oriented chamfer matching). The best few are then moved, with six degrees of freedom, until the model's
edges lie upon steps of grey levels across them (as of Harris' tracker), by robust least squares with what is known of
the place before. What several places explain equally well is told.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from imaging.features.displaced import points_by_deviations
from imaging.features.rim_sides import seen_along
from imaging.geometry.lens import lens_jacobian
from imaging.geometry.projection import camera_frame, facing, jacobian, project, project_ideal
from imaging.geometry.visibility import boundaries, visible_spans
from imaging.pictures import Pictures
from imaging.placed import combined, difference, placed, turn, turn_vector
from scenes import Picture
from scenes.placement import MOST_TILT, limits, root

_COARSE = 320  # px of the shorter side of the picture in which shifts are tried
_BINS = 8  # directions of edges, over half a turn
_NEAR = 6.0  # px of that picture: farther edges count as none
_STEP = 2  # px of that picture between the shifts that are tried
_ALIKE = 10.0  # degrees of a turn over which the same edges are taken to be seen
_TURN = 2.0  # degrees between the turns that are tried
_POINTS = 240  # of the model
_KEPT, _REFINED, _ALL_ROUND = 4, 12, 60  # places of a turn, of all small turns, and all the way round, that are refined
_BEYOND = 1.25  # of what is plausible: where noise may take a place that is hardly told
_APART = 3.0  # px of the coarse picture between two candidates
_FIRST, _THEN = (24.0, 24.0, 8.0, 8.0), (8.0, 8.0, 3.0, 3.0, 3.0)  # px to both sides in which steps are sought
_FEWER, _BEST = 4, 4  # the model's points are first so many times fewer; places that are looked at with all
_SIGNIFICANT = 6.0  # of the noise of a slope across an edge
_SYMMETRIES = (2, 3, 4, 5, 6)  # parts of a turn that may leave a part as it looks
_ALONG, _BESIDE, _SMALLEST = 0.95, 8.0, 1.5  # cosine of edges side by side; px along them; the least window, px
_EXPLAINED = 0.75  # px from its place at which a step explains a point of the model
_LEAST = 0.5  # share of the model that the right place explains at least
_SAME = 0.75  # of the best place's share of the model that is explained: what explains as much is another answer
_SPREAD = 0.5  # px: of a step's place


@dataclass(frozen=True, eq=False)
class Place:
    """A place that may be the part's.

    Attributes
    ----------
    placement : ndarray, shape (6 + c,)
        Shift, the scene's unit, rotation vector, degrees, and the camera's deviations (`scenes.placement.root`).
    explained : float
        Share of the model's visible edges upon which a step of grey levels lies.
    """

    placement: np.ndarray
    explained: float

    def __str__(self) -> str:
        shift, turn = (", ".join(f"{value:.3g}" for value in part) for part in np.split(self.placement[:6], 2))
        return f"shift ({shift}), turn ({turn}) degrees"


@dataclass(frozen=True, eq=False)
class Outline:
    """Points of the edges that a picture shows of its part, (n, 3), and directions of the edges there, unit (n, 3)."""

    points: np.ndarray
    along: np.ndarray

    def thinned(self, fewer: int) -> Outline:
        """Every so many of the points."""
        return Outline(self.points[::fewer], self.along[::fewer])

    def seen(self, picture: Picture) -> tuple[np.ndarray, np.ndarray]:
        """Images of the points and unit normals of the edges there, px, (n, 2) each."""
        sensor, camera = np.array(list(picture.sensor)), picture.scene.camera
        ahead = np.einsum("nij,nj->ni", jacobian(self.points, sensor, camera), self.along)
        normal = np.stack([-ahead[:, 1], ahead[:, 0]], -1)
        size = np.linalg.norm(normal, axis=-1, keepdims=True)
        return project(self.points, sensor, camera), normal / np.where(size > 0, size, 1.0)


def outline(picture: Picture, count: int = _POINTS) -> Outline:
    """That of a picture, at about so many places that lie evenly over edges and rims."""
    pictures, solid = Pictures.of(picture.unlit()), picture.scene.bodies
    seen = facing(solid, pictures.viewpoint)
    shown = [e for e, there in zip(solid.sharp, boundaries(solid, solid.sharp, seen), strict=True) if there]
    spans = [
        (solid.vertices[list(edge.ends)], span)
        for edge in shown
        for span in visible_spans(solid, edge, pictures.viewpoint)
    ]
    rims = [circle for circle in solid.rims if circle.radius > 0]
    lengths = [(b - a) * float(np.linalg.norm(ends[1] - ends[0])) for ends, (a, b) in spans]
    lengths += [circle.turn * circle.radius for circle in rims]
    step = max(sum(lengths), 1e-300) / count
    points, along = [], []
    for (ends, (a, b)), length in zip(spans, lengths, strict=False):
        share = a + (b - a) * _evenly(length, step)
        points.append(ends[0] + share[:, None] * (ends[1] - ends[0]))
        along.append(np.broadcast_to((ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0]), points[-1].shape))
    for circle, length in zip(rims, lengths[len(spans) :], strict=True):
        angle = circle.angles(len(_evenly(length, step)))
        there = seen_along(pictures, circle, angle)
        points.append(circle.at(angle)[there])
        along.append(np.cross(circle.axis, circle.spokes(angle))[there])
    return Outline(np.concatenate(points), np.concatenate(along))


def _evenly(length: float, step: float) -> np.ndarray:
    count = max(2, round(length / step))
    return (np.arange(count) + 0.5) / count


def candidates(image: np.ndarray, picture: Picture) -> tuple[Place, ...]:
    """Places within the plausible ones that explain an image, the best first, no two alike.

    Parameters
    ----------
    image : ndarray, shape (height, width)
        Grey levels.
    picture : Picture
        The part where the scene says; `scenes.Placement` and ``uncertainty`` say how far off it may be.

    Returns
    -------
    tuple of Place
        None where nothing is explained.
    """
    slopes = _Slopes.of(image, picture)
    near = [_refined(slopes, picture, start, _FIRST, model.thinned(_FEWER)) for start, model in _starts(image, picture)]

    def finer(starts: Iterable[np.ndarray]) -> list[Place]:
        each = (_refined(slopes, picture, start, _THEN, outline(placed(picture, start))) for start in starts)
        return [one for one in each if one.explained >= _LEAST and _is_plausible(picture, one.placement)]

    found = _different(picture, finer(each.placement for each in _different(picture, near)[:_BEST]))
    alike = _turned_alike(picture, found[0].placement) if found else []
    return tuple(_different(picture, [*found, *finer(alike)]))


def _different(picture: Picture, found: list[Place]) -> list[Place]:
    """The best first, none like one before."""
    kept: list[Place] = []
    for each in sorted(found, key=lambda one: -one.explained):
        if all(_shifts(picture, difference(each.placement, one.placement)) > _APART for one in kept):
            kept.append(each)
    return kept


def _is_plausible(picture: Picture, placement: np.ndarray) -> bool:
    """Whether its shift, and its tilt and turn one after the other, are within what the scene says, and a little."""
    expected, axis = picture.scene.placement.mean[:6], _free_axis(picture)
    left = placement[:6] - expected
    if axis is not None:  # a rotation vector's components are no tilts where it is long
        about = 2 * np.degrees(np.arctan(_half_tangent(turn(placement[3:6]), axis)))
        tilt = turn_vector(turn(placement[3:6]) @ turn(about * axis).T)
        left = np.concatenate([left[:3], tilt + about * axis - expected[3:]])
    return bool((np.abs(left) <= _BEYOND * limits(picture.scene.uncertainty) + 1e-9).all())


def _half_tangent(rotation: np.ndarray, axis: np.ndarray) -> float:
    """Of half the angle by which a rotation turns about an axis, before it tilts it (swing and twist)."""
    odd = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    whole = 1 + float(np.trace(rotation))  # 4 cos^2 of half the whole angle
    return float(axis @ odd) / max(whole, 1e-12)


def rivals(found: tuple[Place, ...]) -> tuple[Place, ...]:
    """Those that explain a picture as well as the best does."""
    return tuple(each for each in found[1:] if 1 - each.explained <= (1 - found[0].explained) / _SAME + 0.01)


def _shifts(picture: Picture, placement: np.ndarray) -> float:
    """How far a placement moves the part's picture at most, px."""
    moved = _recorded_by(picture, picture.scene.solid.vertices) @ placement
    return float(np.linalg.norm(moved, axis=-1).max())


def _recorded_by(picture: Picture, points: np.ndarray) -> np.ndarray:
    """Derivatives (n, 2, 6 + c) of where points are recorded by placement and the camera's deviations, px."""
    sensor, scene = np.array(list(picture.sensor)), picture.scene
    lens = lens_jacobian(project_ideal(points, sensor, scene.camera), scene.camera)
    return lens @ points_by_deviations(points, sensor, scene)


def _free_axis(picture: Picture) -> np.ndarray | None:
    """The axis about which the part may lie anyhow, a unit vector; None where all turns are small."""
    reach = limits(picture.scene.uncertainty)[3:]
    return None if reach.max() <= MOST_TILT else np.eye(3)[reach.argmax()]


def _turned_alike(picture: Picture, placement: np.ndarray) -> list[np.ndarray]:
    """Places at which a part of rotational symmetry would look the same: about its middle, by parts of a turn."""
    axis, here = _free_axis(picture), placed(picture, placement)
    if axis is None:
        return []
    corners, pivot = here.scene.solid.vertices, np.array(here.scene.camera.look_at)
    away = (corners.min(0) + corners.max(0)) / 2 - pivot
    angles = sorted({360 * k / count for count in _SYMMETRIES for k in range(1, count)})
    more = np.zeros(len(placement) - 6)
    return [combined(placement, np.concatenate([away - turn(a * axis) @ away, a * axis, more])) for a in angles]


def _starts(image: np.ndarray, picture: Picture) -> list[tuple[np.ndarray, Outline]]:
    """Placements of shifts along the image and turns, about the line of sight or the one axis about which the part may
    lie anyhow, that lie best upon edges, and what is seen there."""
    shrink = max(1, min(image.shape) // _COARSE)
    near = _nearness(cv2.resize(image.astype(np.float32), None, fx=1 / shrink, fy=1 / shrink,
                                interpolation=cv2.INTER_AREA))  # fmt: skip
    sensor, camera = np.array(list(picture.sensor)), picture.scene.camera
    axes, reach = camera_frame(camera, sensor), limits(picture.scene.uncertainty)
    free = _free_axis(picture)
    axis = axes.forward if free is None else free
    across = [float(np.abs(axis) @ reach[:3]) for axis in (axes.right, axes.down)]
    scale = camera.focal_px / camera.distance / shrink
    most = np.ceil(np.array(across) * scale / _STEP).astype(int)
    rows, model, of, camera_as_said = [], None, np.inf, np.zeros(len(picture.scene.placement.camera))
    for angle in _angles(float(np.abs(axis) @ reach[3:])):
        turned = placed(picture, np.concatenate([np.zeros(3), angle * axis]))
        if model is None or abs(angle - of) > _ALIKE:
            model, of = outline(turned), angle
        at, normal = model.seen(turned)
        score = _score(near, (at + 0.5) / shrink - 0.5, normal, most)
        for y, x in _peaks(score):
            along = _STEP / scale * ((x - most[0]) * axes.right + (y - most[1]) * axes.down)
            rows.append((score[y, x], np.concatenate([along, angle * axis, camera_as_said]), model))
    kept: list[tuple[np.ndarray, Outline]] = []
    for _, placement, model in sorted(rows, key=lambda row: -row[0]):
        apart = (_shifts(picture, difference(placement, other)) for other, _ in kept)
        if len(kept) < (_REFINED if free is None else _ALL_ROUND) and all(each > _STEP * shrink for each in apart):
            kept.append((placement, model))
    return kept


def _angles(most: float) -> np.ndarray:
    """Turns, degrees, evenly over twice the most, or all the way round."""
    if most >= 180:
        return np.arange(-180.0, 180.0, _TURN)
    count = int(np.ceil(most / _TURN))
    return np.linspace(-most, most, 2 * count + 1)


def _nearness(image: np.ndarray) -> np.ndarray:
    """Of edges of each direction at each pixel: 1 upon one, 0 from `_NEAR` px on, (bins, height, width)."""
    smooth = cv2.GaussianBlur(image, (0, 0), 1.0)
    across, down = (cv2.Sobel(smooth, cv2.CV_32F, *way) for way in ((1, 0), (0, 1)))
    size = np.hypot(across, down)
    edge = size > max(0.1 * float(np.quantile(size, 0.999)), 3 * float(np.median(size)))
    bin_of = np.floor(np.arctan2(down, across) / np.pi * _BINS).astype(int) % _BINS
    found = np.zeros((_BINS, *image.shape), np.float32)
    for k in range(_BINS):
        mine = edge & np.isin(bin_of, [(k - 1) % _BINS, k, (k + 1) % _BINS])
        away = cv2.distanceTransform((~mine).astype(np.uint8), cv2.DIST_L2, 3) if mine.any() else np.inf
        found[k] = np.maximum(1 - away / _NEAR, 0.0)
    return found


def _score(near: np.ndarray, at: np.ndarray, normal: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Mean nearness of points (n, 2) of edges with normals, at all shifts by `_STEP` px up to the most in x and y,
    shape (shifts in y, shifts in x)."""
    bins = np.floor(np.arctan2(normal[:, 1], normal[:, 0]) / np.pi * _BINS).astype(int) % _BINS
    count = 2 * most + 1
    total = np.zeros(count[::-1], np.float32)
    first = np.rint(at).astype(int) - _STEP * most
    beyond = max(int(-first.min(initial=0)), int((first + _STEP * count).max(initial=0) - min(near.shape[1:])), 0)
    wide = np.pad(near, ((0, 0), (beyond, beyond), (beyond, beyond)))
    span = _STEP * count
    for (x, y), k in zip(first + beyond, bins, strict=True):
        total += wide[k, y : y + span[1] : _STEP, x : x + span[0] : _STEP]
    return total / max(len(at), 1)


def _peaks(score: np.ndarray) -> np.ndarray:
    """The best local maxima of a table, their rows and columns, (n, 2)."""
    best = cv2.dilate(score, np.ones((5, 5), np.uint8))
    there = np.argwhere((score >= best) & (score > 0))
    return there[np.argsort(-score[tuple(there.T)])[:_KEPT]]


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Derivatives of an image along x and y, smoothed, (height, width) each, and their noise."""

    across: np.ndarray
    down: np.ndarray
    noise: float

    @classmethod
    def of(cls, image: np.ndarray, picture: Picture) -> _Slopes:
        smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 1.0)
        slopes = (cv2.Sobel(smooth, cv2.CV_32F, *way, scale=1 / 8) for way in ((1, 0), (0, 1)))
        sigma = float(np.sqrt(np.mean(picture.scene.noise.variance)))
        return cls(*slopes, noise=sigma * 0.15)

    def steps(self, at: np.ndarray, normal: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Where across edges (n,) the steepest step lies, px along the normal, and whether it stands out, bool (n,)."""
        step = max(reach / 12, 0.5)
        away = np.arange(-reach, reach + step / 2, step)
        places = at[:, None] + away[:, None] * normal[:, None]
        rise = np.abs(normal[:, :1] * _bilinear(self.across, places) + normal[:, 1:] * _bilinear(self.down, places))
        rise = rise * (1 - 0.5 * (away / (reach + step)) ** 2)  # of steps alike the nearer one
        best = np.where(np.abs(away) <= _own(at, normal)[:, None], rise, 0.0).argmax(1)
        rows, inner = np.arange(len(at)), np.clip(best, 1, len(away) - 2)
        before, here, after = (rise[rows, inner + k] for k in (-1, 0, 1))
        bend = before - 2 * here + after
        finer = np.where((bend < 0) & (best == inner), (before - after) / (2 * np.where(bend < 0, bend, -1.0)), 0.0)
        good = (here > _SIGNIFICANT * self.noise) & (best == inner) & (here >= np.maximum(before, after))
        return away[best] + np.clip(finer, -0.5, 0.5) * step, good


def _own(at: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """How far across an edge at places (n, 2) a step is still its own, px, (n,): halfway to the next edge beside it.

    Else a faint edge of the model would be drawn upon a strong one that runs along it.
    """
    away = at[None] - at[:, None]
    across = np.abs(np.einsum("ijk,ik->ij", away, normal))
    along = np.abs(away[..., 0] * -normal[:, None, 1] + away[..., 1] * normal[:, None, 0])
    beside = (np.abs(normal @ normal.T) > _ALONG) & (along <= _BESIDE) & (across > _BESIDE / 4)
    return np.maximum(np.where(beside, across, np.inf).min(1, initial=np.inf) / 2, _SMALLEST)


def _bilinear(image: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Of an image at places (..., 2), 0 outside."""
    x, y = (places[..., i].astype(np.float32) for i in (0, 1))
    return cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0)


def _refined(slopes: _Slopes, picture: Picture, start: np.ndarray, reaches: tuple[float, ...], model: Outline) -> Place:
    """The place near a start at which steps lie upon the model's edges, with what is known of it before."""
    here, free = start, root(picture.scene)
    back = np.linalg.pinv(free)
    for reach in reaches:
        there = placed(picture, here)
        at, normal = model.seen(there)
        off, good = slopes.steps(at, normal, reach)
        rows = np.einsum("ni,nik->nk", normal, _recorded_by(there, model.points)) @ free
        known = back @ there.scene.placement.mean
        here = combined(here, free @ _robust(rows, np.where(good, off, np.nan), known, reach))
    at, normal = model.seen(placed(picture, here))
    off, good = slopes.steps(at, normal, reaches[-1])
    return Place(here, float((good & (np.abs(off) < _EXPLAINED)).mean()))


def _robust(rows: np.ndarray, off: np.ndarray, known: np.ndarray, reach: float) -> np.ndarray:
    """Least squares (k,) of offsets (n,), NaN of none, by Tukey's weights, with expectations of variance 1."""
    there = np.isfinite(off)
    rows, off = rows[there], off[there]
    found, scale = np.zeros(rows.shape[1]), reach
    for _ in range(4):
        left = off - rows @ found
        weight = np.maximum(1 - (left / (2 * scale)) ** 2, 0.0) ** 2 / _SPREAD**2
        normal = rows.T @ (rows * weight[:, None]) + np.eye(len(found))
        found = np.linalg.solve(normal, rows.T @ (weight * off) + known)
        scale = max(1.5 * float(np.median(np.abs(left))) if left.size else reach, 0.5)
    return found
