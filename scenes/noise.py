"""The sensor's noise."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scenes.model import Model
from scenes.ranges import Darkness, NotNegative, Trace


class Noise(Model):
    """The sensor's noise, in the terms of EMVA 1288, then ``bits`` of digits.

    ``dark_level`` is the grey level of darkness, which keeps noise from being cut off at 0. ``sigma`` (grey levels) is
    the temporal dark noise, read noise included. ``gain`` (grey levels an electron) makes shot noise of variance
    gain x (level - dark_level). ``prnu`` (part of the signal) and ``dsnu`` (grey levels) are the
    standard deviations of the fixed pattern, the same in every picture of the camera that ``pattern_seed`` names.
    Without ``bits`` grey levels stay real numbers; with it they are rounded and clipped to 0 .. 2^bits - 1.
    """

    sigma: Trace
    bits: Annotated[int, Field(ge=1, le=16)] | None = None
    gain: NotNegative = 0.0
    dark_level: Darkness = 0.0
    prnu: NotNegative = 0.0
    dsnu: NotNegative = 0.0
    pattern_seed: Annotated[int, Field(ge=0)] = 0

    @property
    def variance(self) -> float:
        """Variance of a grey level in darkness, rounding included (1/12 of a squared grey level)."""
        return self.sigma**2 + (0.0 if self.bits is None else 1 / 12)
