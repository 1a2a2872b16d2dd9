"""Values with their derivatives: points, lines, numbers, as functions of what was found in a picture.

Derivatives are by the parameters of `imaging.features.seen.Seen`, the small errors of lines and circles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

DEGREE = float(np.degrees(1.0))
Moves = Mapping[int, np.ndarray]
"""Derivatives by some of the parameters, by their numbers; all others are 0."""


class Evaluated(NamedTuple):
    """A number's value (...) and its derivatives (...)."""

    value: np.ndarray
    gradient: Moves

    def times(self, factor: np.ndarray | float) -> Evaluated:
        """The number times a factor (...)."""
        return Evaluated(factor * self.value, {k: factor * slope for k, slope in self.gradient.items()})


@dataclass(frozen=True, eq=False)
class Point:
    """A point in the image (k = 2) or in space (k = 3), shape (..., k), with its derivatives (..., k)."""

    at: np.ndarray
    moves: Moves


@dataclass(frozen=True)
class Line:
    """A line through two points, the edge's ends."""

    start: Point
    stop: Point


def between(start: Point, stop: Point) -> Evaluated:
    """Distance of two points."""
    across = stop.at - start.at
    value = np.linalg.norm(across, axis=-1)
    pull = across / value[..., None]
    return Evaluated(value, pulled([(pull, stop.moves), (-pull, start.moves)]))


def from_line(point: Point, line: Line, plane: np.ndarray | None, side: np.ndarray | float) -> Evaluated:
    """Distance of a point from a line, positive on the given side; a line moves as both its ends do."""
    along = line.stop.at - line.start.at
    length = np.linalg.norm(along, axis=-1)[..., None]
    normal = across(along / length, plane) * np.asarray(side)[..., None]
    away = point.at - line.start.at
    share = np.einsum("...i,...i->...", away, along)[..., None] / length**2
    moved = [(normal, point.moves), (-(1 - share) * normal, line.start.moves), (-share * normal, line.stop.moves)]
    return Evaluated(np.einsum("...i,...i->...", normal, away), pulled(moved))


def between_lines(lines: list[Line], signs: list[int], plane: np.ndarray | None) -> Evaluated:
    """Angle between two lines, each taken along (+1) or against (-1) its edge, degrees."""
    units, turns = [], []
    for line, sign in zip(lines, signs, strict=True):
        along = line.stop.at - line.start.at
        length = np.linalg.norm(along, axis=-1)[..., None]
        normal = across(along / length, plane) / length
        units.append(sign * along / length)
        turns.append([(normal, line.stop.moves), (-normal, line.start.moves)])
    crossing = np.einsum("...i,...i->...", across(units[0], plane), units[1])
    value = DEGREE * np.arctan2(np.abs(crossing), np.einsum("...i,...i->...", *units))
    opens = (DEGREE * np.sign(crossing))[..., None]
    moved = [(s * opens * n, m) for s, turn in zip((-1, 1), turns, strict=True) for n, m in turn]
    return Evaluated(value, pulled(moved))


def along_line(start: Point, stop: Point, line: Line) -> Evaluated:
    """How far it is from one point to another along a line, from the line's first end to its last."""
    return _component(start, stop, line, None, is_along=True)


def across_line(start: Point, stop: Point, line: Line, plane: np.ndarray | None) -> Evaluated:
    """The same across a line, to the side where `across` of its direction points."""
    return _component(start, stop, line, plane, is_along=False)


def _component(start: Point, stop: Point, line: Line, plane: np.ndarray | None, *, is_along: bool) -> Evaluated:
    """The line turns by what its ends move across it, and the component with it, by the way's other component."""
    way, along = stop.at - start.at, line.stop.at - line.start.at
    length = np.linalg.norm(along, axis=-1)[..., None]
    unit = along / length
    if is_along:  # across the line in the way's own plane
        beside = way - _dot(way, unit)[..., None] * unit
        direction, turned = unit, beside / length
    else:
        direction = across(unit, plane)
        turned = -(_dot(way, unit)[..., None] / length) * direction
    moved = (direction, stop.moves), (-direction, start.moves), (turned, line.stop.moves), (-turned, line.start.moves)
    return Evaluated(_dot(way, direction), pulled(moved))


def total(numbers: Iterable[Evaluated]) -> Evaluated:
    """The sum of some."""
    value, gradient = 0.0, {}
    for each in numbers:
        value = value + each.value
        gradient = {k: gradient.get(k, 0.0) + each.gradient.get(k, 0.0) for k in {*gradient, *each.gradient}}
    return Evaluated(np.asarray(value), gradient)


def mean(points: list[Point]) -> Point:
    """The middle of some."""
    share = 1 / len(points)
    return Point(
        np.stack([point.at for point in points]).mean(0), _mapped([(lambda m: share * m, p.moves) for p in points])
    )


def shared(line: Line, share: np.ndarray) -> Point:
    """The place on a line that is a share (...) of its length from its first end."""
    share = share[..., None]
    ends = (line.start, 1 - share), (line.stop, share)
    return Point(
        sum((part * end.at for end, part in ends), np.zeros(())),
        _mapped([(lambda move, part=part: part * move, end.moves) for end, part in ends]),
    )


def beside(first: Point, second: Point, plane: np.ndarray | None, left: np.ndarray | float) -> Point:
    """The first point moved by the way to the second, turned by a right angle: `left` (...) times `across` of it."""

    def turned(way: np.ndarray) -> np.ndarray:
        return np.asarray(left)[..., None] * across(way, plane)

    parts = [(lambda move: move - turned(move), first.moves), (turned, second.moves)]
    return Point(first.at + turned(second.at - first.at), _mapped(parts))


def foot(point: Point, line: Line) -> Point:
    """The place on a line that is nearest to a point."""
    along = line.stop.at - line.start.at
    length = np.linalg.norm(along, axis=-1)[..., None]
    unit, away = along / length, point.at - line.start.at
    reach = _dot(away, unit)[..., None]
    beside = away - reach * unit

    def of_point(move: np.ndarray) -> np.ndarray:
        return unit * _dot(unit, move)[..., None]

    def of_end(share: np.ndarray, way: int) -> Callable[[np.ndarray], np.ndarray]:
        def moved(move: np.ndarray) -> np.ndarray:
            sideways = move - of_point(move)
            return share * sideways + way * unit * (_dot(beside, move)[..., None] / length)

        return moved

    share = reach / length
    parts = [(of_point, point.moves), (of_end(1 - share, -1), line.start.moves), (of_end(share, 1), line.stop.moves)]
    return Point(line.start.at + reach * unit, _mapped(parts))


def crossing(one: Line, other: Line, plane: np.ndarray | None) -> Point:
    """Where two lines of a plane cross: it is moved by what each line moves across itself there."""
    ways = [line.stop.at - line.start.at for line in (one, other)]
    normals = [across(way, plane) for way in ways]
    away = other.start.at - one.start.at
    shares = [
        _dot(away, normals[1]) / _dot(ways[0], normals[1]),
        -_dot(away, normals[0]) / _dot(ways[1], normals[0]),
    ]
    at = one.start.at + shares[0][..., None] * ways[0]
    parts = []
    for k, line in enumerate((one, other)):  # along the other line, until it is on this one again
        slide = ways[1 - k] / _dot(ways[1 - k], normals[k])[..., None]
        for share, moves in ((1 - shares[k], line.start.moves), (shares[k], line.stop.moves)):
            pull = share[..., None] * normals[k]
            parts.append((lambda move, s=slide, p=pull: s * _dot(p, move)[..., None], moves))
    return Point(at, _mapped(parts))


_NEWTON = 8  # steps from the circle of an algebraic fit, which points of a pattern are near


def circle_through(points: list[Point], plane: np.ndarray | None) -> tuple[Point, Evaluated]:
    """Centre and radius of the circle whose distances from at least three points have the least squares.

    Its condition is G = sum r (u, 1) = 0, r a point's distance from the circle and u the unit vector to it from the
    centre; its derivative by points and circle gives the latter's moves, exact also where points are off the circle.
    """
    origin, frame = points[0].at, _frame(points[1].at - points[0].at, plane)
    at = np.stack([np.einsum("...ij,...j->...i", frame, point.at - origin) for point in points], -2)
    circle = _algebraic(at)
    for _ in range(_NEWTON):
        _, whole, off = _circle_condition(at, circle)
        circle = circle + np.linalg.solve(whole, off[..., None])[..., 0]
    pulls, whole, _ = _circle_condition(at, circle)
    response = np.linalg.solve(whole[..., None, :, :], pulls)  # (..., n, 3, 2)
    moves: dict[int, np.ndarray] = {}
    for i, point in enumerate(points):
        for k, move in point.moves.items():
            flat = np.einsum("...ij,...j->...i", frame, move)
            moves[k] = moves.get(k, 0.0) + np.einsum("...ij,...j->...i", response[..., i, :, :], flat)
    back = np.swapaxes(frame, -1, -2)
    centre = Point(
        origin + np.einsum("...ij,...j->...i", back, circle[..., :2]),
        {k: np.einsum("...ij,...j->...i", back, move[..., :2]) for k, move in moves.items()},
    )
    return centre, Evaluated(circle[..., 2], {k: move[..., 2] for k, move in moves.items()})


def _frame(way: np.ndarray, plane: np.ndarray | None) -> np.ndarray:
    """Two perpendicular unit vectors of a plane, or of the image, the first along a way in it, shape (..., 2, k)."""
    unit = way / np.linalg.norm(way, axis=-1, keepdims=True)
    return np.stack(np.broadcast_arrays(unit, across(unit, plane)), -2)


def _algebraic(at: np.ndarray) -> np.ndarray:
    """Centre and radius, (..., 3), of x^2 + y^2 = 2 a x + 2 b y + c by least squares, points (..., n, 2)."""
    design = np.concatenate([2 * at, np.ones((*at.shape[:-1], 1))], -1)
    normal = np.einsum("...ni,...nj->...ij", design, design)
    a, b, c = np.moveaxis(
        np.linalg.solve(normal, np.einsum("...ni,...n->...i", design, (at**2).sum(-1))[..., None])[..., 0], -1, 0
    )
    return np.stack([a, b, np.sqrt(c + a**2 + b**2)], -1)


def _circle_condition(at: np.ndarray, circle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivative of G by each point (..., n, 3, 2), by minus the circle (..., 3, 3), and G itself (..., 3)."""
    away = at - circle[..., None, :2]
    far = np.linalg.norm(away, axis=-1)[..., None]
    unit, off = away / far, far - circle[..., None, 2:]
    both = np.concatenate([unit, np.ones_like(far)], -1)
    outer = unit[..., :, None] * unit[..., None, :]
    turn = (off / far)[..., None] * (np.eye(2) - outer)
    pulls = np.concatenate([outer + turn, unit[..., None, :]], -2)
    return pulls, np.concatenate([pulls.sum(-3), both.sum(-2)[..., None]], -1), (off * both).sum(-2)


def plane_through(points: list[Point]) -> tuple[Point, Point]:
    """The middle of at least three points and the unit normal, of either sign, of their least-squares plane.

    The normal n is the eigenvector of the least eigenvalue of the points' scatter M; it moves by the others e_k, each
    by (e_k . dM n) / (l_n - l_k).
    """
    centre = mean(points)
    away = np.stack([point.at for point in points], -2) - centre.at[..., None, :]
    sizes, axes = np.linalg.eigh(np.einsum("...ni,...nj->...ij", away, away))
    normal, others, gaps = axes[..., 0], axes[..., 1:], sizes[..., :1] - sizes[..., 1:]
    moves: dict[int, np.ndarray] = {}
    for i, point in enumerate(points):
        height = _dot(away[..., i, :], normal)[..., None]
        for k, move in point.moves.items():
            scatter = away[..., i, :] * _dot(move, normal)[..., None] + height * move
            turned = np.einsum("...ik,...i->...k", others, scatter) / gaps
            moves[k] = moves.get(k, 0.0) + np.einsum("...ik,...k->...i", others, turned)
    return centre, Point(normal, moves)


def over_plane(point: Point, centre: Point, normal: Point, outside: np.ndarray) -> Evaluated:
    """Height of a point over the plane through another of a unit normal, positive to the side of a vector (3,)."""
    up = np.sign(_dot(normal.at, outside))[..., None]
    way = point.at - centre.at
    parts = (up * normal.at, point.moves), (-up * normal.at, centre.moves), (up * way, normal.moves)
    return Evaluated(_dot(up * normal.at, way), pulled(parts))


def between_planes(normals: list[Point], outside: list[np.ndarray]) -> Evaluated:
    """180 degrees less the angle between two planes' unit normals, each towards its vector (3,), degrees."""
    ups = [np.sign(_dot(normal.at, out))[..., None] for normal, out in zip(normals, outside, strict=True)]
    one, other = (up * normal.at for up, normal in zip(ups, normals, strict=True))
    sine, cosine = np.linalg.norm(np.cross(one, other), axis=-1), _dot(one, other)
    opens = (DEGREE / sine)[..., None]
    parts = (opens * ups[0] * other, normals[0].moves), (opens * ups[1] * one, normals[1].moves)
    return Evaluated(180.0 - DEGREE * np.arctan2(sine, cosine), pulled(parts))


def across(unit: np.ndarray, plane: np.ndarray | None) -> np.ndarray:
    """Unit vector across a direction (..., k): (-y, x) in the image, normal x direction on a plane."""
    if plane is None:
        return np.stack([-unit[..., 1], unit[..., 0]], -1)
    return np.cross(plane, unit)


def pulled(parts: Iterable[tuple[np.ndarray, Moves]]) -> Moves:
    """Sum of directions . moves, by parameter."""
    total: dict[int, np.ndarray] = {}
    for direction, moves in parts:
        for k, move in moves.items():
            total[k] = total.get(k, 0.0) + np.einsum("...i,...i->...", direction, move)
    return total


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", one, other)


def _mapped(parts: Iterable[tuple[Callable[[np.ndarray], np.ndarray], Moves]]) -> Moves:
    """Sum of linear maps of moves, by parameter."""
    found: dict[int, np.ndarray] = {}
    for mapped, moves in parts:
        for k, move in moves.items():
            found[k] = found.get(k, 0.0) + mapped(move)
    return found
