"""The round cylinder."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from scenes.parts.surfaces.quadric import Quadric
from scenes.parts.surfaces.ruled import Ruled
from scenes.parts.surfaces.surface import checked, length, point, stretch, unit


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A round cylinder, or the wall of a round hole.

    Attributes
    ----------
    point : ndarray, shape (3,)
        On the axis.
    axis : ndarray, shape (3,)
        Unit vector.
    radius : float
    ends : tuple of float
        Between which heights z0..z1 over the point, along the axis; infinite where not given.
    hollow : bool
        Whether the material is outside.

    Raises
    ------
    InvalidInput
        If a number is not finite, or radius or ends are not positive.

    Examples
    --------
    >>> pin = Cylinder((0, 0, 0), (0, 0, 1), 2.0, (0, 5))
    >>> pin.intersections(np.array([-10.0, 0, 1]), np.array([1.0, 0, 0])).tolist()
    [8.0, 12.0]
    """

    point: np.ndarray
    axis: np.ndarray
    radius: float
    ends: tuple[float, float] = (-math.inf, math.inf)
    hollow: bool = False

    kind: ClassVar[str] = "cylinder"
    parameters: ClassVar[tuple[str, ...]] = ("x", "y", "z", "tilt1", "tilt2", "radius")

    def __post_init__(self) -> None:
        checked(
            self,
            point=point("cylinder.point", self.point),
            axis=unit("cylinder.axis", self.axis),
            radius=length("cylinder.radius", self.radius),
            ends=stretch("cylinder.ends", self.ends),
        )

    @cached_property
    def ruled(self) -> Ruled:
        """As one of the surfaces that cones are, too."""
        return Ruled(self.point, self.axis, self.radius, 0.0, self.ends, self.hollow)

    @cached_property
    def quadric(self) -> Quadric:
        """The whole cylinder as an equation of second degree."""
        flat = np.eye(3) - np.outer(self.axis, self.axis)
        return Quadric.about(self.point, flat, np.zeros(3), -(self.radius**2), self.hollow)

    def values(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (..., 3)."""
        return self.ruled.values(points)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals away from the material, (..., 3)."""
        return self.ruled.normals(points)

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        """Derivative of the normal by the place, (..., 3, 3)."""
        return self.ruled.shape_operator(points)

    def third(self, points: np.ndarray, tangents: np.ndarray) -> np.ndarray:
        """Third derivative of the height along tangents: 0."""
        return self.ruled.third(points, tangents)

    def shifts(self, points: np.ndarray) -> np.ndarray:
        """Move along the normal for a change of each parameter, (..., 6)."""
        return self.ruled.shifts(points, taper=False)

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where lines meet it, (..., 2)."""
        return self.ruled.intersections(origins, directions)

    def within(self, points: np.ndarray) -> np.ndarray:
        """Whether points lie between its ends."""
        return self.ruled.within(points)

    def area_points(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Points evenly by area from the unit square; for finite ends."""
        return self.ruled.area_points(u, v)
