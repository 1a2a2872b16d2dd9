"""Lights."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator

from scenes.model import Model
from scenes.ranges import Curve, Length, rising


class Light(Model):
    """A light on a sphere around the reference point (`Camera.look_at`); ``distance`` in cm.

    ``radius`` (cm) is 0 for a point. ``polarisation_deg`` is the direction of polarisation, seen along the
    beam: from the direction away from the pole (0) towards that of growing azimuth (90); None for unpolarised light.
    ``spectrum`` is Q of eq. 1, rows [nm, relative value].
    """

    distance: Length
    radius: Annotated[float, Field(ge=0)] = 0.0
    polarisation_deg: float | None = None
    spectrum: Curve = ()

    @field_validator("spectrum")
    @classmethod
    def _in_order(cls, rows: tuple) -> tuple:
        return rising("light.spectrum", rows)
