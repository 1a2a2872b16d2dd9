"""The contour of a general quadric.

A line e + t d through the eye e meets f = x'Ax + b'x + c in two, one or no points as d'Md is positive, zero or
negative, M = g g' - f(e) A with g half the gradient at e. It touches in the eye's polar plane
g . X + b . e / 2 + c = 0, where the contour is a conic. In homogeneous coordinates (e, s), of an eye that may be at
infinity, f(e) = e'Ae + s b'e + s^2 c, g = Ae + s b / 2, and the plane is g . X + b . e / 2 + s c = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.contours.statuses import DEGENERATE, INSIDE, NONE, OK, TANGENT
from scenes.parts.surfaces import Quadric, axes_beside
from scenes.parts.surfaces.surface import outwards
from scenes.viewpoint import Viewpoint

_TANGENT, _RANK = 1e-11, 1e-11  # of the largest part
_INFINITE = 1e-9  # of the homogeneous coordinates' length: a last one below is a point too far away
_CENTRE = 1e-9  # of A: a bend in the polar plane below is none, the conic has no centre that way
_ROUNDING = 1e-13  # of its terms' sizes: a value of f below is 0
_POLISH = 2
_NODES, _ROUNDS, _LEAST = np.linspace(0, 1, 257), 4, 0.1  # of the angles seen from the eye; least share of a step


@dataclass(frozen=True, eq=False)
class Touched:
    """A conic in the polar plane: l1 x^2 + l2 y^2 = l3 z^2 in homogeneous coordinates ``axes`` (3, 3) of the plane.

    They run once around that cone, x and y on the ellipse that unit vectors have, z positive, at about equal angles
    seen from the eye. ``frame`` (3, 2) and ``start`` (3,) take the plane's coordinates to space.
    """

    quadric: Quadric
    eye: Viewpoint
    levels: tuple[float, float, float]
    axes: np.ndarray
    start: np.ndarray
    frame: np.ndarray
    closed: bool = True

    def points(self, u: np.ndarray) -> np.ndarray:
        """Points (n, 3); those at infinity are put far away on their line."""
        place = self._homogeneous(np.interp(np.asarray(u), _NODES, self._turns))
        last = np.copysign(np.maximum(np.abs(place[:, 2]), _INFINITE), place[:, 2])
        points = self.start + (place[:, :2] / last[:, None]) @ self.frame.T
        return _polished(self.quadric, self.eye, points)

    def _homogeneous(self, turn: np.ndarray) -> np.ndarray:
        """Homogeneous coordinates (n, 3) at angles (n,)."""
        one, two, three = self.levels
        x = np.cos(turn) * np.sqrt(three / (one + three))
        y = np.sin(turn) * np.sqrt(three / (two + three))
        z = np.sqrt((one * x**2 + two * y**2) / three)
        return np.stack([x, y, z], -1) @ self.axes.T

    @cached_property
    def _turns(self) -> np.ndarray:
        """Angles at which the line of sight has turned by equal parts."""
        turns, away = 2 * np.pi * _NODES, self.start - self.eye.origins(self.start)
        for _ in range(_ROUNDS):
            place = self._homogeneous(turns)
            way = place[:, :2] @ self.frame.T + place[:, 2:] * away
            way = way / np.linalg.norm(way, axis=1, keepdims=True)
            step = np.linalg.norm(np.cross(way[1:], way[:-1]), axis=1)
            run = np.concatenate([[0.0], np.cumsum(step + _LEAST * step.sum() / len(step))])
            turns = np.interp(_NODES, run / run[-1], turns)
        return turns


def quadric_branches(quadric: Quadric, eye: Viewpoint) -> tuple[str, tuple[Touched, ...]]:
    """Status and branches from an eye."""
    at, less = eye.at, eye.share - 1
    level = quadric.function(at) + less * (quadric.linear @ at) + (eye.share**2 - 1) * quadric.constant
    half = quadric.gradient(at) / 2 + less * quadric.linear / 2
    size = max(abs(level) * np.abs(quadric.form).max(), half @ half)
    if not quadric.form.any() or not size > 0:
        return DEGENERATE, ()
    if abs(level) * np.abs(quadric.form).max() <= _TANGENT * size:
        return TANGENT, ()
    start, frame = _polar_plane(quadric, eye, half)
    values, vectors = np.linalg.eigh(_in_plane(quadric, start, frame))
    large = np.abs(values).max()
    if np.sort(np.abs(values))[1] <= _RANK * large:
        return DEGENERATE, ()
    if level * outwards(quadric.hollow) < 0:
        return INSIDE, ()
    if values[1] < 0:
        values, vectors = -values[::-1], vectors[:, ::-1]
    if values[0] >= -_RANK * large:
        return NONE, ()
    levels = float(max(values[1], 0.0)), float(values[2]), float(-values[0])
    return OK, (Touched(quadric, eye, levels, vectors[:, [1, 2, 0]], start, frame),)


def _polar_plane(quadric: Quadric, eye: Viewpoint, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A point of the polar plane, the conic's centre where it has one, and two vectors in it of about its size.

    However far the eye is, the plane is near the quadric: its coordinates lose nothing.
    """
    normal = half / np.linalg.norm(half)
    beside = np.stack(axes_beside(normal), -1)
    start = -(quadric.linear @ eye.at / 2 + eye.share * quadric.constant) / np.linalg.norm(half) * normal
    values, vectors = np.linalg.eigh(beside.T @ quadric.form @ beside)
    curved = np.abs(values) > _CENTRE * np.abs(quadric.form).max()
    along = beside @ vectors
    slope = quadric.gradient(start) @ along / 2
    start = start - along[:, curved] @ (slope[curved] / values[curved])
    bend, over = np.abs(values).max(), abs(quadric.function(start))
    far, out = np.linalg.norm(eye.towards(start)), np.linalg.norm(start)
    known = np.abs(quadric.form).max() * out**2 + np.linalg.norm(quadric.linear) * out + abs(quadric.constant)
    clear = over > _ROUNDING * known and over < bend * far**2
    return start, along * (np.sqrt(over / bend) if clear else far)


def _in_plane(quadric: Quadric, start: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """The conic's matrix (3, 3) in the plane's homogeneous coordinates, of largest element 1."""
    side = quadric.gradient(start) @ frame / 2
    found = np.block(
        [[frame.T @ quadric.form @ frame, side[:, None]], [side[None], np.array([[quadric.function(start)]])]]
    )
    return found / max(np.abs(found).max(), np.finfo(float).tiny)


def _polished(quadric: Quadric, eye: Viewpoint, points: np.ndarray) -> np.ndarray:
    """Newton's method for f(X) = 0 and grad f(X) . (s X - e) = 0, along the normal and the line of sight.

    It settles what the rank of a nearly degenerate conic left open.
    """
    for _ in range(_POLISH):
        slope, away = quadric.gradient(points), -eye.towards(points)
        far = np.linalg.norm(away, axis=-1, keepdims=True)
        size = np.linalg.norm(slope, axis=-1, keepdims=True)
        with np.errstate(all="ignore"):
            normal, sight = slope / size, away / far
            bent = 2 * away @ quadric.form
            a, b = (slope * normal).sum(-1), (slope * sight).sum(-1)
            bent = bent + eye.share * slope
            c, d = (bent * normal).sum(-1), (bent * sight).sum(-1)
            one, two = -quadric.function(points), -(slope * away).sum(-1)
            both = a * d - b * c
            move = ((one * d - two * b) / both)[:, None] * normal + ((a * two - c * one) / both)[:, None] * sight
            small = np.linalg.norm(move, axis=-1, keepdims=True) < 1e-3 * far  # and finite
        points = points + np.where(small, move, 0.0)
    return points
