"""The round cone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from scenes.errors import InvalidInput
from scenes.parts.surfaces.quadric import Quadric
from scenes.parts.surfaces.ruled import Ruled
from scenes.parts.surfaces.surface import checked, length, point, stretch, unit

_STEEPEST = 89.999


@dataclass(frozen=True, eq=False)
class Cone:
    """A round cone: one sheet, with its radius at a point of the axis, so that a slight taper needs no far apex.

    Attributes
    ----------
    point : ndarray, shape (3,)
        On the axis.
    axis : ndarray, shape (3,)
        Unit vector.
    radius : float
        At the point.
    half_angle_deg : float
        Between axis and wall; positive where the radius grows along the axis. -89.999 to 89.999.
    ends : tuple of float
        Between which heights z0..z1 over the point; the radius must not be negative there. Infinite where not given,
        or up to the apex.
    hollow : bool
        Whether the material is outside.

    Raises
    ------
    InvalidInput
        If a number is not finite, the radius not positive, or the apex lies between the ends.
    """

    point: np.ndarray
    axis: np.ndarray
    radius: float
    half_angle_deg: float
    ends: tuple[float, float] = (-math.inf, math.inf)
    hollow: bool = False

    kind: ClassVar[str] = "cone"
    parameters: ClassVar[tuple[str, ...]] = ("x", "y", "z", "tilt1", "tilt2", "radius", "half_angle")

    def __post_init__(self) -> None:
        angle, radius = self.half_angle_deg, length("cone.radius", self.radius)
        number = isinstance(angle, int | float | np.floating) and not isinstance(angle, bool)
        if not number or not abs(angle) <= _STEEPEST:
            raise InvalidInput(f"cone.half_angle_deg must be from -{_STEEPEST} to {_STEEPEST}, got {angle!r}")
        low, high = stretch("cone.ends", self.ends)
        slope = math.tan(math.radians(angle))
        if slope:
            apex = -radius / slope
            low = apex if slope > 0 and math.isinf(low) else low
            high = apex if slope < 0 and math.isinf(high) else high
            least = min((radius + slope * z for z in (low, high) if math.isfinite(z)), default=radius)
            if least < -1e-9 * radius:
                raise InvalidInput(f"cone.ends must be on one side of the apex at {apex:g}, got {self.ends!r}")
        checked(self, point=point("cone.point", self.point), axis=unit("cone.axis", self.axis), radius=radius)
        checked(self, half_angle_deg=float(angle), ends=(low, high))

    @property
    def slope(self) -> float:
        """Growth of the radius along the axis."""
        return math.tan(math.radians(self.half_angle_deg))

    @cached_property
    def ruled(self) -> Ruled:
        """As one of the surfaces that cylinders are, too."""
        return Ruled(self.point, self.axis, self.radius, self.slope, self.ends, self.hollow)

    @cached_property
    def quadric(self) -> Quadric:
        """Both sheets as an equation of second degree."""
        form = np.eye(3) - (1 + self.slope**2) * np.outer(self.axis, self.axis)
        linear = -2 * self.radius * self.slope * self.axis
        return Quadric.about(self.point, form, linear, -(self.radius**2), self.hollow)

    def values(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (..., 3) near the wall."""
        return self.ruled.values(points)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals away from the material, (..., 3)."""
        return self.ruled.normals(points)

    def shape_operator(self, points: np.ndarray) -> np.ndarray:
        """Derivative of the normal by the place, (..., 3, 3)."""
        return self.ruled.shape_operator(points)

    def third(self, points: np.ndarray, tangents: np.ndarray) -> np.ndarray:
        """Third derivative of the height along tangents."""
        return self.ruled.third(points, tangents)

    def shifts(self, points: np.ndarray) -> np.ndarray:
        """Move along the normal for a change of each parameter, the half angle in rad, (..., 7)."""
        return self.ruled.shifts(points, taper=True)

    def intersections(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where lines meet this sheet, (..., 2)."""
        return self.ruled.intersections(origins, directions)

    def within(self, points: np.ndarray) -> np.ndarray:
        """Whether points lie between its ends."""
        return self.ruled.within(points)

    def area_points(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Points evenly by area from the unit square; for finite ends."""
        return self.ruled.area_points(u, v)
