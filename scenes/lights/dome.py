"""A dome of light around the reference point."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.lights.kinds import LIGHTS
from scenes.lights.luminaire import Luminaire, Surface, gauss, turned

_DOWN = 32  # pieces from its opening to its rim


@LIGHTS.add("dome")
class Dome(Luminaire):
    """Part of a sphere of radius ``distance`` around the reference point, shining inwards, open at its top."""

    kind: Literal["dome"]
    """dome"""
    half_angle_deg: Annotated[float, Field(gt=0, le=90)] = 90.0
    """From its axis to its rim [degrees]."""
    opening_deg: Annotated[float, Field(ge=0, lt=90)] = 0.0
    """From its axis to the rim of the hole at its top, through which the camera looks [degrees]."""

    @model_validator(mode="after")
    def _not_empty(self) -> Dome:
        if self.opening_deg >= self.half_angle_deg:
            got = f"{self.opening_deg:g} and {self.half_angle_deg:g}"
            raise ValueError(f"opening_deg must be less than half_angle_deg, got {got}")
        return self

    @property
    def half_size(self) -> float:
        """Its radius [length]."""
        return self.distance

    def surface(self, count: int) -> Surface:
        """Gauss nodes in the cosine of the angle from the axis; normals towards the reference point."""
        share, weight, around = gauss(count)
        low, high = np.cos(np.radians([self.half_angle_deg, self.opening_deg]))
        cosine = low + share * (high - low)
        up = np.array([0.0, 0.0, 1.0])
        away = -cosine[:, None, None] * up + np.sqrt(1 - cosine**2)[:, None, None] * around
        away = away.reshape(-1, 3)
        areas = np.repeat(weight * 2 * np.pi * (high - low) * self.distance**2 / len(around), len(around))
        return Surface(self.distance * (away + up), -away, areas)

    def shape(self) -> dict[str, Any]:
        """Triangles of the sphere's part."""
        angles = np.radians(np.linspace(self.opening_deg, self.half_angle_deg, _DOWN + 1))
        return turned(self.distance * np.sin(angles), self.distance * (1 - np.cos(angles)))
