"""The sphere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from scenes.parts.surfaces.quadric import Quadric
from scenes.parts.surfaces.roots import quadratic_roots
from scenes.parts.surfaces.surface import checked, length, outwards, point


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere.

    Attributes
    ----------
    centre : ndarray, shape (3,)
    radius : float
    hollow : bool
        Whether the material is outside.

    Raises
    ------
    InvalidInput
        If a number is not finite or the radius not positive.

    Examples
    --------
    >>> Sphere((0, 0, 0), 1.0).intersections(np.array([3.0, 1, 0]), np.array([-1.0, 0, 0])).tolist()
    [3.0, 3.0]
    """

    centre: np.ndarray
    radius: float
    hollow: bool = False

    kind: ClassVar[str] = "sphere"
    parameters: ClassVar[tuple[str, ...]] = ("x", "y", "z", "radius")

    def __post_init__(self) -> None:
        checked(self, centre=point("sphere.centre", self.centre), radius=length("sphere.radius", self.radius))

    @cached_property
    def quadric(self) -> Quadric:
        """As an equation of second degree."""
        return Quadric.about(self.centre, np.eye(3), np.zeros(3), -(self.radius**2), self.hollow)

    def values(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (..., 3)."""
        return outwards(self.hollow) * (np.linalg.norm(points - self.centre, axis=-1) - self.radius)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals away from the material, (..., 3)."""
        away = points - self.centre
        return outwards(self.hollow) * away / np.linalg.norm(away, axis=-1, keepdims=True)

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        """Derivative of the normal by the place, (..., 3, 3)."""
        normal = self.normals(points)
        return outwards(self.hollow) / self.radius * (np.eye(3) - normal[..., :, None] * normal[..., None, :])

    def shifts(self, points: np.ndarray) -> np.ndarray:
        """Move along the normal for a change of each parameter, (..., 4)."""
        normal = self.normals(points)
        return np.concatenate([normal, np.full((*normal.shape[:-1], 1), outwards(self.hollow))], -1)

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where lines meet it, (..., 2); counted from where they are nearest to the centre."""
        origins, directions = np.broadcast_arrays(np.asarray(origins, float), np.asarray(directions, float))
        away, square = origins - self.centre, (directions**2).sum(-1)
        start = -(away * directions).sum(-1) / square
        near = np.linalg.norm(away + start[..., None] * directions, axis=-1)
        found = quadratic_roots(square, np.zeros_like(square), (near - self.radius) * (near + self.radius))
        return found + start[..., None]

    def within(self, points: np.ndarray) -> np.ndarray:
        """True: it has no ends."""
        return np.ones(np.shape(points)[:-1], bool)
