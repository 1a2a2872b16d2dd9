"""A ring of light around its axis."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.lights.kinds import LIGHTS
from scenes.lights.luminaire import Luminaire, Surface, annulus, turned
from scenes.ranges import NotNegative, Positive


@LIGHTS.add("ring")
class Ring(Luminaire):
    """A ring around its axis, flat or tilted inwards as part of a cone, of equal radiance everywhere."""

    kind: Literal["ring"]
    """ring"""
    inner_radius: NotNegative
    """Of its hole [length]."""
    outer_radius: Positive
    """Of its rim [length]."""
    tilt_deg: Annotated[float, Field(ge=0, lt=90)] = 0.0
    """Between its surface and the plane across its axis: it shines inwards, and its outer rim is nearer [degrees]."""

    @model_validator(mode="after")
    def _not_empty(self) -> Ring:
        if self.inner_radius >= self.outer_radius:
            got = f"{self.inner_radius:g} and {self.outer_radius:g}"
            raise ValueError(f"inner_radius must be less than outer_radius, got {got}")
        return self

    @property
    def half_size(self) -> float:
        """Its outer radius [length]."""
        return self.outer_radius

    def surface(self, count: int) -> Surface:
        """Nodes on it."""
        return annulus(self.inner_radius, self.outer_radius, float(np.radians(self.tilt_deg)), count)

    def shape(self) -> dict[str, Any]:
        """Triangles of a cone's frustum."""
        radii = np.array([self.inner_radius, self.outer_radius])
        return turned(radii, (radii - radii.mean()) * np.tan(np.radians(self.tilt_deg)))
