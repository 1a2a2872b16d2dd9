"""The round cone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from scenes.errors import InvalidInput
from scenes.parts.surfaces.quadric import Quadric
from scenes.parts.surfaces.ruled import Ruled
from scenes.parts.surfaces.surface import checked, length, point, stretch, unit

_STEEPEST = 89.999


@dataclass(frozen=True, eq=False)
class Cone(Ruled):
    """A round cone: one sheet, with its radius at a point of the axis, so that a slight taper needs no far apex.

    Attributes
    ----------
    half_angle_deg : float
        Between axis and wall; positive where the radius grows along the axis. -89.999 to 89.999.
    point, axis, radius, ends, hollow
        As of `Ruled`; the radius must not be negative between the ends, which are up to the apex where not given.

    Raises
    ------
    InvalidInput
        If a number is not finite, the radius not positive, or the apex lies between the ends.
    """

    half_angle_deg: float = field(kw_only=True)

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
    def quadric(self) -> Quadric:
        """Both sheets as an equation of second degree."""
        form = np.eye(3) - (1 + self.slope**2) * np.outer(self.axis, self.axis)
        linear = -2 * self.radius * self.slope * self.axis
        return Quadric.about(self.point, form, linear, -(self.radius**2), self.hollow)
