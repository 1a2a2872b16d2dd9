"""What every surface can tell."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from scenes.errors import InvalidInput
from scenes.materials.vectors import cross

_LARGEST = 1e9  # of a coordinate, as of a mesh


class Surface(Protocol):
    """A surface in object coordinates, in the scene's unit.

    A ``hollow`` one has the material outside, as the wall of a hole; its normals are reversed.

    Attributes
    ----------
    kind : str
        Its name in tables.
    parameters : tuple of str
        Names of the p numbers whose small changes `shifts` speaks of. A tilt is in rad, about the point that says
        where the surface is: the axis moves towards the first or second of `axes_beside`.
    hollow : bool
    """

    kind: str
    parameters: tuple[str, ...]
    hollow: bool

    def values(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (..., 3) from the surface to first order, positive outside the material, (...)."""

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals away from the material at points (..., 3) of the surface, (..., 3)."""

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        """Derivative of the unit normal by the place on the surface, symmetric, (..., 3, 3), one over length.

        v S v is the normal curvature along a unit tangent v, positive where the surface bends away from its normal.
        """

    def shifts(self, points: np.ndarray) -> np.ndarray:
        """How far the surface moves along its normal at points (..., 3) for a change of each parameter, (..., p)."""

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """All t, rising, at which lines origin + t direction (..., 3) meet the surface, (..., k); infinite where fewer.

        Lines that touch it have the same t twice; those that lie in it have none.
        """

    def within(self, points: np.ndarray) -> np.ndarray:
        """Whether points (..., 3) of the surface lie between its ends, bool (...)."""


def checked(instance: Any, **values: Any) -> None:
    """Set checked fields of a frozen dataclass: vectors become float arrays of shape (3,)."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def point(key: str, value: Any) -> np.ndarray:
    """A checked point, shape (3,).

    Raises
    ------
    InvalidInput
        If it is no three finite numbers up to 1e9.
    """
    try:
        found = np.array(value, float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (3,) or not np.isfinite(found).all() or np.abs(found).max() > _LARGEST:
        raise InvalidInput(f"{key} must be three numbers up to {_LARGEST:g}, got {value!r}")
    return found


def unit(key: str, value: Any) -> np.ndarray:
    """A checked direction, of length 1, shape (3,); errors as of `point`, and of length 0."""
    found = point(key, value)
    size = np.linalg.norm(found / max(np.abs(found).max(), 1e-300))
    if not size > 0:
        raise InvalidInput(f"{key} must be a direction, got {value!r}")
    return found / np.abs(found).max() / size


def length(key: str, value: Any) -> float:
    """A checked positive length."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating) or not 0 < value <= _LARGEST:
        raise InvalidInput(f"{key} must be more than 0 and at most {_LARGEST:g}, got {value!r}")
    return float(value)


def stretch(key: str, ends: Any) -> tuple[float, float]:
    """Checked ends along an axis, the lower first; they may be infinite."""
    try:
        low, high = map(float, ends)
    except (TypeError, ValueError):
        low = high = math.nan
    if not low < high:
        raise InvalidInput(f"{key} must be two rising numbers, got {ends!r}")
    return low, high


def axes_beside(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (3,) that make a right-handed frame with a unit axis (3,).

    >>> [v.tolist() for v in axes_beside(np.array([0.0, 0.0, 1.0]))]
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    smallest = np.eye(3)[np.abs(axis).argmin()]
    one = smallest - (smallest @ axis) * axis
    one = one / np.linalg.norm(one)
    return one, np.array(cross(axis, one))


def outwards(hollow: bool) -> float:
    """-1 for a hollow surface, whose normals are reversed."""
    return -1.0 if hollow else 1.0
