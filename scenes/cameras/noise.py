"""The sensor's noise."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

from pydantic import Field, model_validator

from scenes.cameras.colour import Colour
from scenes.model import Model
from scenes.ranges import Bounded, Darkness, NotNegative, Spread, Trace


class Noise(Model):
    """The sensor's noise, in the terms of EMVA 1288, then ``bits`` of digits."""

    sigma: Trace
    """Temporal dark noise, read noise included [grey levels]."""
    bits: Annotated[int, Field(ge=1, le=16)] | None = None
    """Levels are rounded and clipped to 0 .. 2^bits - 1; left out: real numbers."""
    gain: NotNegative = 0.0
    """Makes shot noise of variance gain x (level - dark_level) [grey levels an electron]."""
    excess: tuple[tuple[NotNegative, Bounded], ...] = ()
    """Variance beside that, of a sensor that is not linear: rows of signal above darkness [grey levels] and variance
    [grey levels^2], on straight lines between them, as at the last one beyond; `measure.photon_transfer` tells them."""
    row_sigma: Spread = 0.0
    """Beside ``sigma``: what all pixels of a row share in one picture, as read-out noise does [grey levels]."""
    column_sigma: Spread = 0.0
    """The same of columns [grey levels]."""
    dark_level: Darkness = 0.0
    """Level of darkness, which keeps noise from being cut off at 0 [grey levels]."""
    prnu: NotNegative = 0.0
    """Standard deviation of the fixed pattern, part of the signal."""
    dsnu: NotNegative = 0.0
    """Standard deviation of the fixed pattern in darkness [grey levels]."""
    pattern_seed: Annotated[int, Field(ge=0)] = 0
    """Which camera: the fixed pattern is the same in all its pictures."""
    colour: Colour | None = None
    """Colour filters on the pixels, whose raw noise all other keys then tell; left out: a monochrome sensor."""

    @model_validator(mode="after")
    def _check_shared(self) -> Noise:
        if self.is_shared and self.colour is not None:
            raise ValueError(
                f"row_sigma and column_sigma must be 0 with colour filters, got {self.row_sigma:g} and "
                f"{self.column_sigma:g}"
            )
        return self

    @model_validator(mode="after")
    def _check_excess(self) -> Noise:
        signals = [signal for signal, _ in self.excess]
        if any(a >= b for a, b in pairwise(signals)) or (signals and signals[0] != 0):
            raise ValueError(f"excess must be rows of rising signal from 0 on, got {signals}")
        if self.excess and (self.colour is not None or not self.gain > 0):
            other = "no colour filters" if self.colour is not None else f"gain {self.gain:g}"
            raise ValueError(f"excess must stand beside a gain above 0 and without colour filters, got {other}")
        for signal, excess in self.excess:
            if self.sigma**2 + self.gain * signal + excess <= 0:
                raise ValueError(f"excess must leave a variance above 0, got {excess:g} at signal {signal:g}")
        return self

    @property
    def is_shared(self) -> bool:
        """Whether pixels of a row or of a column have noise in common."""
        return self.row_sigma > 0 or self.column_sigma > 0

    @property
    def variance(self) -> float:
        """Variance of a grey level in darkness, rounding included (1/12 of a squared grey level).

        What rows and columns share is beside it (`imaging.row_noise`).

        With colour filters that of white noise which moves an edge as much (`Colour.noise_factor`).
        """
        return self.factor(2) * (self.sigma**2 + (0.0 if self.bits is None else 1 / 12))

    @property
    def shot_gain(self) -> float:
        """Variance that the light's own noise adds over the signal, of the same white noise [grey levels]."""
        return self.factor(1) * self.gain

    def factor(self, power: int) -> float:
        """`Colour.noise_factor`; 1 of a monochrome sensor."""
        return 1.0 if self.colour is None else self.colour.noise_factor(power)
