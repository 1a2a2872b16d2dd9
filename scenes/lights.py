"""Lights."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator

from scenes.model import Model
from scenes.ranges import Curve, Length, rising


class Light(Model):
    """A light on a sphere around the reference point (`Camera.look_at`)."""

    distance: Length
    """From ``look_at`` [length]."""
    radius: Annotated[float, Field(ge=0)] = 0.0
    """0 for a point [length]."""
    polarisation_deg: float | None = None
    """Seen along the beam, from away from the pole (0) to growing azimuth (90); left out: none [degrees]."""
    spectrum: Curve = ()
    """Q of eq. 1: rows [nm, relative value]; constant where not given."""

    @field_validator("spectrum")
    @classmethod
    def _in_order(cls, rows: tuple) -> tuple:
        return rising("light.spectrum", rows)
