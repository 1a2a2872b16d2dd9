"""The round cylinder."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from scenes.parts.surfaces.quadric import Quadric
from scenes.parts.surfaces.ruled import Ruled
from scenes.parts.surfaces.surface import checked, length, point, stretch, unit


@dataclass(frozen=True, eq=False)
class Cylinder(Ruled):
    """A round cylinder, or the wall of a round hole; attributes as of `Ruled`.

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
    def quadric(self) -> Quadric:
        """The whole cylinder as an equation of second degree."""
        flat = np.eye(3) - np.outer(self.axis, self.axis)
        return Quadric.about(self.point, flat, np.zeros(3), -(self.radius**2), self.hollow)
