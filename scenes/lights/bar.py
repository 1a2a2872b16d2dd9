"""A flat rectangle of light."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from scenes.lights.kinds import LIGHTS
from scenes.lights.luminaire import Luminaire, Surface, rectangle, square
from scenes.ranges import Positive


@LIGHTS.add("bar")
class Bar(Luminaire):
    """A flat rectangle, of equal radiance everywhere and in all directions before it."""

    kind: Literal["bar"]
    """bar"""
    length: Positive
    """Along its own axis to the right [length]."""
    width: Positive
    """Down [length]."""
    turn_deg: float = 0.0
    """By which it is turned about its axis, from right towards down [degrees]."""

    @property
    def half_size(self) -> float:
        """Half of its diagonal [length]."""
        return float((self.length**2 + self.width**2) ** 0.5 / 2)

    def surface(self, count: int) -> Surface:
        """Nodes on it."""
        return rectangle((self.length, self.width), float(np.radians(self.turn_deg)), count)

    def shape(self) -> dict[str, Any]:
        """A rectangle."""
        return square((self.length / 2, self.width / 2), float(np.radians(self.turn_deg)))
