"""What lies beside a circular edge: levels on both sides, what disturbs a locator, and what shading does to it."""

from __future__ import annotations

from collections import defaultdict
from functools import lru_cache

import numpy as np

from imaging.features.locator import edge_blur, reach
from imaging.geometry.blur import blur_in_focus
from imaging.geometry.projection import from_axis, jacobian_ideal, project
from imaging.geometry.rays import first_face
from imaging.light.appearance import face_signal
from imaging.light.behind import behind
from imaging.light.edge_sides import of_sides
from imaging.pictures import Pictures
from scenes import Circle, Edge, Solid
from scenes.viewpoint import Viewpoint

RIM_POINTS = 64
_JUMP = 0.2  # of the contrast between neighbouring places
_MOST_SHIFT = 0.08  # px by shading: beyond, the wall is seen too flat for a first order
_MOST_AWAY = 16  # places beyond which no jump is looked for
_AT_ONCE = 1 << 17  # numbers
_STEP = 0.25  # px that a slope is taken over


def within_ends(pictures: Pictures, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Whether places at angles of an arc are farther from its ends than disturbs a locator, bool, shape (..., n).

    Where it is not the place counts as none: the boundary goes on otherwise there.
    """
    if circle.ends is None:
        return np.ones((*pictures.sensors.shape[:-1], angle.size), bool)
    scene = pictures.scene
    there = _image(pictures, circle.at(angle))
    ends = _image(pictures, circle.ends)
    nearest = np.linalg.norm(there[..., None, :] - ends[..., None, :, :], axis=-1).min(-1)
    return nearest >= reach(scene.locator.scale_px, scene.camera.most_blur_px)


def outward_normals(pictures: Pictures, circle: Circle, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the rim's image: unit normals away from its middle (..., n, 2), the projection's derivative (..., n, 2, 3),
    and image lengths for a radian (..., n), ideal px."""
    one, two = circle.axes
    radial = circle.spokes(angle)
    slope = jacobian_ideal(circle.centre + circle.radius * radial, pictures.sensors, pictures.scene.camera)
    step = circle.radius * (np.cos(angle)[:, None] * two - np.sin(angle)[:, None] * one)
    tangent = np.einsum("...nij,nj->...ni", slope, step)
    speed = np.linalg.norm(tangent, axis=-1)
    normal = np.stack([tangent[..., 1], -tangent[..., 0]], -1) / speed[..., None]
    away = np.einsum("...ni,...nij,nj->...n", normal, slope, radial)
    return np.where(away[..., None] < 0, -normal, normal), slope, speed


def shading_shift(pictures: Pictures, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """How far outwards shading moves the zero crossing along a rim, ideal px, shape (..., n); 0 where nothing is known.

    S^2 (m_b - m_a) / (B - A), levels A inside and B outside and their slopes m per px outwards, S^2 the variance of the
    smoothed edge. Along a wall that is seen at a slant the brightness changes across the rim as it does around it.
    """
    scene = pictures.scene
    radial = circle.spokes(angle)
    points = circle.centre + circle.radius * radial
    one, two = circle.axes
    along = np.cos(angle)[:, None] * two - np.sin(angle)[:, None] * one
    normal, slope, _ = outward_normals(pictures, circle, angle)
    sense = 1.0 if circle.hole else -1.0  # the face lies outside a hole, inside the end of a cylinder
    face_step = _step_on(slope, along, radial, sense * _STEP * normal)
    wall_step = _step_on(slope, along, np.broadcast_to(-circle.axis, radial.shape), -sense * _STEP * normal)
    turned = angle + wall_step[..., 0] / circle.radius
    spokes = np.cos(turned)[..., None] * one + np.sin(turned)[..., None] * two
    face_at = points + face_step[..., :1] * along + face_step[..., 1:] * radial
    wall_at = circle.centre + circle.radius * spokes - wall_step[..., 1:] * circle.axis
    levels = _sides_at(pictures, circle, angle, True)
    slopes, view = [], pictures.viewpoint.widened()
    both = zip((levels[..., 0, :], levels[..., 1, :]), (face_at, wall_at), (circle.axis, -sense * spokes), strict=True)
    for (level, at, facing), face in zip(both, sided(scene.solid, circle), strict=True):
        there = face_signal(pictures, at, face, 1, normals=np.broadcast_to(facing, at.shape))
        towards = np.einsum("...i,...i->...", np.broadcast_to(facing, at.shape), view.towards(at))
        slopes.append(np.where((level > 0) & (there > 0) & (towards > 0), (there - level) / _STEP, 0.0))
    contrast = levels[..., 0, :] - levels[..., 1, :]  # face less wall; outside less inside, or the other way round
    blur = blur_in_focus(scene.camera, project(points, pictures.sensors, scene.camera))
    variance = scene.locator.scale_px**2 + edge_blur(blur) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        found = sense * variance * (slopes[0] + slopes[1]) / contrast
    return np.where(np.isfinite(found), found, 0.0)


def _step_on(slope: np.ndarray, first: np.ndarray, second: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Steps (..., n, 2) along two directions (n, 3) of a surface that move the image by ``moved`` (..., n, 2), px."""
    columns = np.stack([np.einsum("...nij,nj->...ni", slope, d) for d in (first, second)], -1)
    (a, b), (c, d) = np.moveaxis(columns, (-2, -1), (0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = np.moveaxis(moved, -1, 0)
        steps = np.stack([d * x - b * y, a * y - c * x], -1) / (a * d - b * c)[..., None]
    return np.where(np.isfinite(steps) & (np.abs(steps) < 1e9), steps, 0.0)


def steady(squared: np.ndarray, shift: np.ndarray, arc: np.ndarray, far: float) -> np.ndarray:
    """Whether a rim's squared contrast (..., n) is even within ``far`` px along it, bool, shape (..., n).

    It jumps where a shadow or another edge meets the rim; where the wall turns away from the sensor, shading shifts the
    edge (..., n) by more than a first order tells. ``arc`` (..., n) is the length that each place stands for, px.
    """
    contrast = np.sqrt(squared)
    onward = np.roll(contrast, -1, -1)
    jump = np.abs(onward - contrast) > _JUMP * np.maximum(onward, contrast)  # between a place and the next
    bent = np.abs(shift) > _MOST_SHIFT
    jump = jump | bent | np.roll(bent, -1, -1)
    arc = np.broadcast_to(arc, jump.shape)
    good, ahead, behind = ~(jump | np.roll(jump, 1, -1)), np.zeros(jump.shape), np.zeros(jump.shape)
    for k in range(1, _MOST_AWAY):
        ahead, behind = ahead + np.roll(arc, 1 - k, -1), behind + np.roll(arc, k - 1, -1)
        if not ((ahead < far) | (behind < far)).any():
            break
        good &= ~(np.roll(jump, -k, -1) & (ahead < far)) & ~(np.roll(jump, k + 1, -1) & (behind < far))
    return good


def contrast_along(
    pictures: Pictures, circle: Circle, angle: np.ndarray, *, fall_off: bool = True
) -> tuple[np.ndarray, np.ndarray | float]:
    """Squared contrast at angles of a rim, 0 where it is hidden, and the noise's variance there."""
    sides = _sides_at(pictures, circle, angle, fall_off)
    if not fall_off:
        return (sides[..., 0, :] - sides[..., 1, :]) ** 2, pictures.scene.noise.variance
    return of_sides(pictures.scene, sides)[:2]


def seen_along(pictures: Pictures, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Whether the sensor sees a rim at angles, whatever the light, bool, shape (..., n)."""
    radial = circle.spokes(angle)
    points = circle.centre + circle.radius * radial
    view = pictures.viewpoint
    turned = [
        np.einsum("...i,...i->...", normal, view.widened().towards(points)) > 0
        for normal in (np.broadcast_to(circle.axis, points.shape), -radial if circle.hole else radial)
    ]
    return (turned[0] | turned[1]) & _free(pictures.scene.bodies, _probe(pictures, circle, points), view)


def clearance(pictures: Pictures, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Distance in the image from places of a rim to the nearest boundary that disturbs them, px, shape (..., n).

    Boundaries are the straight edges of the face, and the wall's other rim where the wall at it is turned to the
    sensor, beside the place or seen through the hole; of an arc also the edges of its wall at its ends.
    """
    solid, radial = pictures.scene.solid, circle.spokes(angle)
    points = circle.centre + circle.radius * radial
    there = _image(pictures, points)
    nearest = np.full(there.shape[:-1], np.inf)
    for other in _far_rims(solid, circle):
        spokes = other.spokes(other.angles(RIM_POINTS))
        far = other.centre + other.radius * spokes
        wall = -spokes if other.hole else spokes
        turned = np.einsum("...i,...i->...", wall, pictures.viewpoint.widened().towards(far)) > 0
        nearest = np.minimum(nearest, to_curve(there, _image(pictures, far), other.joined(turned)))
    ends = _image(pictures, _straight_around(solid, circle))
    return np.minimum(nearest, _to_pieces(there, ends[..., ::2, :], ends[..., 1::2, :]))


@lru_cache(maxsize=64)
def _far_rims(solid: Solid, circle: Circle) -> tuple[Circle, ...]:
    """The other rims that may be those of a circle's wall."""
    return tuple(other for other in solid.rims if _coaxial(circle, other))


@lru_cache(maxsize=64)
def _straight_around(solid: Solid, circle: Circle) -> np.ndarray:
    """Ends of the straight edges of a circle's face, those of one after the other, shape (2 E, 3).

    Of an arc's also the other edges at its ends that are no facets'.
    """
    own = _round(solid).union(circle.edges)
    edges = [edge for edge in _of_faces(solid).get(circle.face, ()) if edge.name not in own]
    if circle.ends is not None:
        last = {tuple(end) for end in circle.ends.tolist()}
        at = [v for v in dict.fromkeys(v for name in circle.edges for v in solid.edge(name).ends)
              if tuple(solid.vertices[v].tolist()) in last]  # fmt: skip
        edges += [edge for v in at for edge in solid.meeting[v] if edge.name not in own and edge.kind != "smooth"]
    ends = [edge.ends for edge in dict.fromkeys(edges)]
    return solid.vertices[np.array(ends, int).ravel()].reshape(-1, 3)


@lru_cache(maxsize=4)
def _round(solid: Solid) -> frozenset[str]:
    """Names of the pieces of all circles."""
    return frozenset(name for circle in solid.circles for name in circle.edges)


@lru_cache(maxsize=4)
def _of_faces(solid: Solid) -> dict[int, list[Edge]]:
    """The edges that meet in each face, in the solid's order."""
    found: dict[int, list[Edge]] = defaultdict(list)
    for edge in solid.edges:
        for face in edge.faces:
            found[face].append(edge)
    return found


def _image(pictures: Pictures, points: np.ndarray) -> np.ndarray:
    return from_axis(points, pictures.sensors, pictures.scene.camera)


def _coaxial(circle: Circle, other: Circle) -> bool:
    """Whether another circle is the far rim of the same wall, or may be: on the same axis, about as wide."""
    across = other.centre - circle.centre
    along = across @ circle.axis
    near = 1e-3 * circle.radius
    return (
        other is not circle
        and other.hole == circle.hole
        and abs(along) > near
        and np.linalg.norm(across - along * circle.axis) < near
        and abs(other.radius - circle.radius) < circle.radius / 2
    )


def to_curve(points: np.ndarray, curve: np.ndarray, shown: np.ndarray | None = None) -> np.ndarray:
    """Distance of points (..., n, 2) from the pieces between points (..., k, 2) of a curve, shape (..., n).

    Of a closed one where ``shown`` (..., k) says which of its pieces count, each from its first point.
    """
    if shown is None:
        return _to_pieces(points, curve[..., :-1, :], curve[..., 1:, :])
    return _to_pieces(points, curve, np.roll(curve, -1, -2), shown)


def _to_pieces(points: np.ndarray, start: np.ndarray, stop: np.ndarray, shown: np.ndarray | None = None) -> np.ndarray:
    """The same from straight pieces between points (..., k, 2), those that are shown; infinite without any."""
    nearest = np.full(points.shape[:-1], np.inf)
    pieces = start.shape[-2]
    many = max(1, _AT_ONCE // max(points.size, 1))
    for k in range(0, pieces, many):
        from_x, from_y = (start[..., None, k : k + many, i] for i in (0, 1))
        along_x, along_y = (stop[..., None, k : k + many, i] - a for i, a in enumerate((from_x, from_y)))
        away_x, away_y = (points[..., None, i] - a for i, a in enumerate((from_x, from_y)))
        size = np.maximum(along_x**2 + along_y**2, np.finfo(float).tiny)
        share = np.clip((away_x * along_x + away_y * along_y) / size, 0, 1)
        apart = np.sqrt((away_x - share * along_x) ** 2 + (away_y - share * along_y) ** 2)
        if shown is not None:
            apart = np.where(shown[..., None, k : k + many], apart, np.inf)
        nearest = np.minimum(nearest, apart.min(-1))
    return nearest


def _probe(pictures: Pictures, circle: Circle, points: np.ndarray) -> np.ndarray:
    """Places that stand for those of a rim where it is asked what they see: the mesh's facets reach into a hole."""
    return circle.centre + (_narrowest(pictures.scene.solid, circle) if circle.hole else 1.0) * (points - circle.centre)


@lru_cache(maxsize=64)
def _narrowest(solid: Solid, circle: Circle) -> float:
    """Radius of the widest circle free of the mesh's facets, over the circle's."""
    middles = solid.vertices[[solid.edge(name).ends for name in circle.edges]].mean(1)
    return float(np.linalg.norm(middles - circle.centre, axis=1).min() / circle.radius)


def _sides_at(pictures: Pictures, circle: Circle, angle: np.ndarray, fall_off: bool) -> np.ndarray:
    """Signals of both sides at angles of a rim, as `_sides` gives them; made once."""
    radial = circle.spokes(angle)
    points = circle.centre + circle.radius * radial
    key = "sides", circle.name, angle.tobytes(), fall_off
    return pictures.once(key, lambda: _sides(pictures, circle, points, radial, fall_off))


def _sides(pictures: Pictures, circle: Circle, points, radial, fall_off) -> np.ndarray:
    """Signals (..., 2, n) of the plane face and of the wall, or what is seen past the rim; 0 at hidden points."""
    bodies, view = pictures.scene.bodies, pictures.viewpoint
    wall = -radial if circle.hole else radial
    probe = _probe(pictures, circle, points)
    lit = tuple(_free(bodies, probe, Viewpoint(emitter.at)) for emitter in pictures.emitters)
    sides = []
    normals = np.broadcast_to(circle.axis, points.shape), wall
    for face, normal in zip(sided(pictures.scene.solid, circle), normals, strict=True):
        turned = np.einsum("...i,...i->...", normal, view.widened().towards(points)) > 0
        sides.append((turned, face_signal(pictures, points, face, 1, lit, normals=normal, fall_off=fall_off)))
    seen = _free(bodies, probe, view) & (sides[0][0] | sides[1][0])
    levels = []
    for turned, level in sides:
        wanted = seen & ~turned
        if wanted.any():
            level = np.where(wanted, behind(pictures, probe, wanted, (circle.face,), fall_off=fall_off), level)
        levels.append(np.where(seen, level, 0.0))
    return np.stack(np.broadcast_arrays(*levels), -2)


def sided(solid: Solid, circle: Circle) -> tuple[int, int]:
    """The plane face of a rim, and one of its wall, which is of one material all round."""
    return circle.face, next(face for face in solid.edge(circle.edges[0]).faces if face != circle.face)


def _free(bodies: Solid, probe, view: Viewpoint) -> np.ndarray:
    """Whether nothing stands between the rim's points and viewpoints (...)."""
    if bodies.is_convex:
        return np.ones((*view.shape, len(probe)), bool)
    start = view.widened().origins(probe)
    _, t = first_face(bodies, start, probe - start, ())
    return t > 1 - 1e-6
