"""A light of a user's own: a spotlight, full within its beam, fading linearly with the angle to its cut-off."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from scenes.lights import FULL, LIGHTS, Luminaire, Nodes


@LIGHTS.add("spotlight")
class Spotlight(Luminaire):
    """A point that shines within a cone."""

    kind: Literal["spotlight"]
    """spotlight"""
    cutoff_deg: Annotated[float, Field(gt=0, lt=90)] = 20.0
    """Beyond this angle from its axis it is dark [degrees]."""
    beam_deg: Annotated[float, Field(gt=0, lt=90)] = 10.0
    """Up to this angle it is as bright as on its axis [degrees]."""

    def nodes(self, reach: float, fewest: int = FULL) -> Nodes:
        """One point."""
        power = self.intensity * self.distance**2
        return Nodes(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.array([power]))

    def profile(self, cosine: np.ndarray) -> np.ndarray:
        """1 within the beam, 0 beyond the cut-off, linear in the angle between."""
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        return np.clip((self.cutoff_deg - angle) / (self.cutoff_deg - self.beam_deg), 0, 1)

    def described(self, axes: np.ndarray, exposure: float, reach: float) -> list[dict]:
        """Mitsuba's own spotlight, which shines along its z axis."""
        strength = exposure * self.intensity * self.distance**2
        return [
            {
                "type": "spot",
                "to_world": axes,
                "intensity": {"type": "spectrum", "value": strength},
                "cutoff_angle": self.cutoff_deg,
                "beam_width": self.beam_deg,
            }
        ]
