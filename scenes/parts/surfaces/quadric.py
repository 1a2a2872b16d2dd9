"""The general surface of second degree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from scenes.errors import InvalidInput
from scenes.parts.surfaces.roots import quadratic_roots
from scenes.parts.surfaces.surface import checked, outwards

_LEVEL = 1e-13  # of its largest coefficient: a line along which the second power is less is met once


@dataclass(frozen=True, eq=False)
class Quadric:
    """f(x) = x'Ax + b'x + c = 0, the material where f < 0 (outside of it, if hollow).

    Attributes
    ----------
    form : ndarray, shape (3, 3)
        A, symmetric.
    linear : ndarray, shape (3,)
        b.
    constant : float
        c.
    hollow : bool

    Raises
    ------
    InvalidInput
        If a coefficient is not finite, or all but the constant are 0.

    Examples
    --------
    >>> ball = Quadric(np.diag([1.0, 1, 4]), (0, 0, 0), -4)
    >>> ball.normals(np.array([0.0, 0, 1])).tolist(), ball.intersections((0, 0, 3), (0, 0, 1)).tolist()
    ([0.0, 0.0, 1.0], [-4.0, -2.0])
    """

    form: np.ndarray
    linear: np.ndarray
    constant: float
    hollow: bool = False

    kind: ClassVar[str] = "quadric"
    parameters: ClassVar[tuple[str, ...]] = ("xx", "yy", "zz", "xy", "xz", "yz", "x", "y", "z", "one")

    def __post_init__(self) -> None:
        form, linear, constant = _numbers(self.form, (3, 3)), _numbers(self.linear, (3,)), _numbers(self.constant, ())
        if form is None or linear is None or constant is None:
            raise InvalidInput("quadric must have finite coefficients: form (3, 3), linear (3), constant; got others")
        if not (form.any() or linear.any()):
            raise InvalidInput("quadric must have a coefficient of some power, got a constant alone")
        checked(self, form=(form + form.T) / 2, linear=linear, constant=float(constant))

    @classmethod
    def about(cls, point: np.ndarray, form: np.ndarray, linear: np.ndarray, constant: float, hollow=False) -> Quadric:
        """The one whose coefficients count from a point (3,)."""
        turned = form @ point
        return cls(form, linear - 2 * turned, constant + point @ turned - linear @ point, hollow)

    @cached_property
    def matrix(self) -> np.ndarray:
        """Q, shape (4, 4): f(x) = (x, 1) Q (x, 1)."""
        return np.block([[self.form, self.linear[:, None] / 2], [self.linear[None] / 2, np.array([[self.constant]])]])

    def function(self, points: np.ndarray) -> np.ndarray:
        """f at points (..., 3)."""
        return ((points @ self.form + self.linear) * points).sum(-1) + self.constant

    def gradient(self, points: np.ndarray) -> np.ndarray:
        """Gradient of f at points, (..., 3)."""
        return 2 * points @ self.form + self.linear

    def values(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (..., 3) to first order; 0 where the gradient vanishes."""
        size = np.linalg.norm(self.gradient(points), axis=-1)
        return outwards(self.hollow) * self.function(points) / np.where(size > 0, size, np.inf)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals away from the material, (..., 3); 0 at a singular point, which has none."""
        away = self.gradient(points)
        size = np.linalg.norm(away, axis=-1, keepdims=True)
        return outwards(self.hollow) * away / np.where(size > 0, size, np.inf)

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        """Derivative of the normal by the place, (..., 3, 3): its Hessian in the tangent plane over the gradient."""
        normal = self.normals(points)
        flat = np.eye(3) - normal[..., :, None] * normal[..., None, :]
        size = np.linalg.norm(self.gradient(points), axis=-1)[..., None, None]
        return outwards(self.hollow) * flat @ (2 * self.form) @ flat / np.where(size > 0, size, np.inf)

    def shifts(self, points: np.ndarray) -> np.ndarray:
        """Move along the normal for a change of each coefficient (that of xy is twice A's element), (..., 10)."""
        x, y, z = np.moveaxis(np.asarray(points, float), -1, 0)
        powers = np.stack([x * x, y * y, z * z, x * y, x * z, y * z, x, y, z, np.ones_like(x)], -1)
        size = np.linalg.norm(self.gradient(points), axis=-1)[..., None]
        return -outwards(self.hollow) * powers / np.where(size > 0, size, np.inf)

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where lines meet it, (..., 2); counted from the middle of both places, where there is one."""
        origins, directions = np.broadcast_arrays(np.asarray(origins, float), np.asarray(directions, float))
        second = ((directions @ self.form) * directions).sum(-1)
        square = (directions**2).sum(-1)
        second = np.where(np.abs(second) <= _LEVEL * np.abs(self.form).max() * square, 0.0, second)
        half = (self.gradient(origins) * directions).sum(-1) / 2
        with np.errstate(all="ignore"):
            start = np.where(second != 0, -half / second, 0.0)
        start = np.where(np.isfinite(start), start, 0.0)
        near = origins + start[..., None] * directions
        half = (self.gradient(near) * directions).sum(-1) / 2
        return quadratic_roots(second, half, self.function(near)) + start[..., None]

    def within(self, points: np.ndarray) -> np.ndarray:
        """True: it has no ends."""
        return np.ones(np.shape(points)[:-1], bool)


def _numbers(value: Any, shape: tuple[int, ...]) -> np.ndarray | None:
    """Finite floats of a shape, else None."""
    try:
        found = np.array(value, float)
    except (TypeError, ValueError):
        return None
    return found if found.shape == shape and np.isfinite(found).all() else None
