"""The kinds of measurands: value and gradient of each, in the image and on the plane of its features.

Each kind is one formula of points and lines; in the image they are two-dimensional, on the plane three-dimensional.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from imaging.features.seen import Line, Moves, Point, Seen
from scenes import Quantity, Side
from scenes.measurands.features import plane_of, points_of

_DEGREE = float(np.degrees(1.0))
_ZERO = 1e-9  # of the object's size: an offset that is none, and has no side


class Evaluated(NamedTuple):
    """A quantity's value (...) and its derivatives (...) by the parameters of `Seen`."""

    value: np.ndarray
    gradient: Moves


def in_image(seen: Seen, quantity: Quantity) -> Evaluated:
    """In the image: px, or degrees."""
    if quantity.kind == "diameter":
        return _diameter_in_image(seen, quantity)
    if quantity.kind == "taper":
        return _taper(seen, quantity)
    if _is_own(quantity):
        return _coordinate(seen, quantity, _along_axis(seen, quantity))
    return _KINDS[quantity.kind](seen, quantity, None, _side(seen, quantity, in_space=False))


def on_plane(seen: Seen, quantity: Quantity) -> Evaluated:
    """On the plane of the features: the scene's unit, or degrees.

    That of `scenes.measurands.features.plane_of`; where that is none, the plane through both points that faces the
    sensor most.
    """
    if quantity.kind == "diameter":
        _, _, radius, number = seen.circle(quantity.features[0])
        return Evaluated(2 * radius, {number: np.full(np.shape(radius), 2.0)})
    if quantity.kind == "taper":
        return _taper(seen, quantity)
    if _is_own(quantity):
        return _coordinate(seen, quantity, 1.0)
    plane = _plane(seen, quantity)
    return _KINDS[quantity.kind](seen, quantity, plane, _side(seen, quantity, in_space=True))


def _plane(seen: Seen, quantity: Quantity) -> np.ndarray:
    """Unit normal of the plane, towards the sensor, shape (..., 3)."""
    points = points_of(seen.solid, quantity)
    ray = points.mean(0) - seen.eye
    normal = plane_of(seen.solid, quantity)
    if normal is None:
        along = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
        normal = ray - (ray @ along)[..., None] * along
        normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    away = np.einsum("...i,...i->...", np.broadcast_to(normal, ray.shape), ray)
    return np.where(away[..., None] > 0, -normal, normal)


def _side(seen: Seen, quantity: Quantity, *, in_space: bool) -> np.ndarray | float:
    """+1 or -1: on which side of its line a nominal offset is, so that it counts as positive, shape (...).

    The in-plane normal is turned one way as the sensor sees the plane, and the other way in the image, whose y axis
    points down.
    """
    if quantity.kind not in ("offset", "width", "position"):
        return 1.0
    points, plane = points_of(seen.solid, quantity), _plane(seen, quantity)
    if quantity.kind == "width":
        point, start, along = points[:2].mean(0), points[2], points[3] - points[2]
    else:
        point, start, along = points[0], points[1], points[2] - points[1]
    away = np.cross(plane, along) @ (point - start)
    sign = np.where(away < -_ZERO * seen.solid.extent * np.linalg.norm(along), -1.0, 1.0)
    return sign if in_space else -sign


def _distance(seen: Seen, quantity: Quantity, plane, side) -> Evaluated:
    start, stop = (seen.point(feature, plane) for feature in quantity.features)
    across = stop.at - start.at
    value = np.linalg.norm(across, axis=-1)
    pull = across / value[..., None]
    return Evaluated(value, _sum([(pull, stop.moves), (-pull, start.moves)]))


def _offset(seen: Seen, quantity: Quantity, plane, side) -> Evaluated:
    feature, datum = quantity.features
    return _from_line(seen.point(feature, plane), seen.line(datum, plane), plane, side)


def _width(seen: Seen, quantity: Quantity, plane, side) -> Evaluated:
    first, second = quantity.features
    return _from_line(seen.middle(first, plane), seen.line(second, plane), plane, side)


def _from_line(point: Point, line: Line, plane, side) -> Evaluated:
    """Distance of a point from a line, positive on the given side; a line moves as both its ends do."""
    along = line.stop.at - line.start.at
    length = np.linalg.norm(along, axis=-1)[..., None]
    normal = side_of(along / length, plane) * np.asarray(side)[..., None]
    away = point.at - line.start.at
    share = np.einsum("...i,...i->...", away, along)[..., None] / length**2
    moved = [(normal, point.moves), (-(1 - share) * normal, line.start.moves), (-share * normal, line.stop.moves)]
    return Evaluated(np.einsum("...i,...i->...", normal, away), _sum(moved))


def _angle(seen: Seen, quantity: Quantity, plane, side) -> Evaluated:
    """Angle between two lines, from their common vertex if they have one, degrees."""
    lines = [seen.line(feature, plane) for feature in quantity.features]
    units, turns = [], []
    for line, sign in zip(lines, _directions(seen, quantity.features), strict=True):
        along = line.stop.at - line.start.at
        length = np.linalg.norm(along, axis=-1)[..., None]
        normal = side_of(along / length, plane) / length
        units.append(sign * along / length)
        turns.append([(normal, line.stop.moves), (-normal, line.start.moves)])
    crossing = np.einsum("...i,...i->...", side_of(units[0], plane), units[1])
    value = _DEGREE * np.arctan2(np.abs(crossing), np.einsum("...i,...i->...", *units))
    opens = (_DEGREE * np.sign(crossing))[..., None]
    return Evaluated(value, _sum([(s * opens * n, m) for s, turn in zip((-1, 1), turns, strict=True) for n, m in turn]))


def _directions(seen: Seen, sides: Iterable[Side]) -> list[int]:
    """+1 or -1 for each of two edges: away from their common vertex; as they are if they have none."""
    ends = [seen.solid.edge(side.edge).ends for side in sides]
    shared = set(ends[0]) & set(ends[1])
    return [1 if not shared or pair[0] in shared else -1 for pair in ends]


def _diameter_in_image(seen: Seen, quantity: Quantity) -> Evaluated:
    """Of the diameter that is parallel to the image: 2 r f / z, z the depth of the centre; no foreshortening."""
    _, centre, radius, number = seen.circle(quantity.features[0])
    per_length = seen.camera.focal_px / seen.depth(centre.at)
    forward = -2 * (radius * per_length / seen.depth(centre.at))[..., None] * seen.axes.forward
    return Evaluated(2 * radius * per_length, {**_sum([(forward, centre.moves)]), number: 2 * per_length})


def _taper(seen: Seen, quantity: Quantity) -> Evaluated:
    """Angle between opposite lines of a cone's wall, degrees: no foreshortening, in the image either."""
    angle, number = seen.half_angle(quantity.features[0])
    sign = np.sign(seen.solid.round(quantity.features[0].surface).half_angle)
    return Evaluated(2 * _DEGREE * sign * angle, {number: np.full(np.shape(angle), 2 * _DEGREE * sign)})


def _is_own(quantity: Quantity) -> bool:
    """Whether it is a ball's coordinate in the scene's own axes."""
    return quantity.kind == "position" and len(quantity.features) == 1


def _level(seen: Seen, quantity: Quantity) -> Point:
    """A ball's centre along the line of sight to it, at the height that the scene gives it."""
    curved, found, _, _ = seen.circle(quantity.features[0])
    sight = found.at - seen.eye
    reach = (curved.centre[2] - seen.eye[..., 2]) / sight[..., 2]
    moves = {
        k: reach[..., None] * (move - sight * (move[..., 2] / sight[..., 2])[..., None])
        for k, move in found.moves.items()
    }
    return Point(seen.eye + reach[..., None] * sight, moves)


def _coordinate(seen: Seen, quantity: Quantity, scale: np.ndarray | float) -> Evaluated:
    """x or y of a ball's centre, times a scale."""
    point, k = _level(seen, quantity), quantity.axis
    return Evaluated(scale * point.at[..., k], {number: scale * move[..., k] for number, move in point.moves.items()})


def _along_axis(seen: Seen, quantity: Quantity) -> np.ndarray:
    """Image of a unit length along the scene's x or y at a ball's centre, px: coordinates in the image are along it."""
    centre, axes = seen.solid.round(quantity.features[0].surface).centre, seen.axes
    z, step = seen.depth(centre), np.eye(3)[quantity.axis]
    screen, away = np.stack([axes.right, axes.down], -2), centre - seen.eye
    slid = seen.camera.focal_px * (
        screen @ step - (screen @ away[..., None])[..., 0] * (axes.forward @ step)[..., None] / z[..., None]
    )
    return np.linalg.norm(slid, axis=-1) / z


def side_of(unit: np.ndarray, plane: np.ndarray | None) -> np.ndarray:
    """Unit vector across a direction (..., k): (-y, x) in the image, normal x direction on a plane."""
    if plane is None:
        return np.stack([-unit[..., 1], unit[..., 0]], -1)
    return np.cross(plane, unit)


def _sum(parts: Iterable[tuple[np.ndarray, Moves]]) -> Moves:
    """Sum of directions . moves, by parameter."""
    total: dict[int, np.ndarray] = {}
    for direction, moves in parts:
        for k, move in moves.items():
            total[k] = total.get(k, 0.0) + np.einsum("...i,...i->...", direction, move)
    return total


_KINDS: dict[str, Callable[..., Evaluated]] = {
    "distance": _distance,
    "offset": _offset,
    "position": _offset,
    "width": _width,
    "angle": _angle,
}
