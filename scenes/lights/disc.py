"""A flat disc of light."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from scenes.lights.kinds import LIGHTS
from scenes.lights.luminaire import Luminaire, Surface, annulus
from scenes.ranges import Positive


@LIGHTS.add("disc")
class Disc(Luminaire):
    """A flat disc, of equal radiance everywhere and in all directions before it."""

    kind: Literal["disc"]
    """disc"""
    radius: Positive
    """Its radius [length]."""

    @property
    def half_size(self) -> float:
        """Its radius [length]."""
        return self.radius

    def surface(self, count: int) -> Surface:
        """Nodes on it."""
        return annulus(0.0, self.radius, 0.0, count)

    def shape(self) -> dict[str, Any]:
        """A disc."""
        return {"type": "disk", "to_world": np.diag([self.radius, self.radius, self.radius, 1.0])}
