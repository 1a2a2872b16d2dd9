"""The sensor's noise."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.special import ndtr

from scenes.model import Model
from scenes.ranges import NotNegative, Trace


class Noise(Model):
    """The sensor's noise, in the terms of EMVA 1288, then ``bits`` of digits.

    ``sigma`` (grey levels) is the temporal dark noise, read noise included. ``gain`` (grey levels an electron) makes
    shot noise of variance gain x (level - dark_level). ``prnu`` (part of the signal) and ``dsnu`` (grey levels) are the
    standard deviations of the fixed pattern, the same in every picture of the camera that ``pattern_seed`` names.
    Without ``bits`` grey levels stay real numbers; with it they are rounded and clipped to 0 .. 2^bits - 1.
    """

    sigma: Trace
    bits: Annotated[int, Field(ge=1, le=16)] | None = None
    gain: NotNegative = 0.0
    dark_level: NotNegative = 0.0
    prnu: NotNegative = 0.0
    dsnu: NotNegative = 0.0
    pattern_seed: Annotated[int, Field(ge=0)] = 0

    @property
    def variance(self) -> float:
        """Variance of a grey level in darkness, rounding included (1/12 of a squared grey level)."""
        return self.sigma**2 + (0.0 if self.bits is None else 1 / 12)

    @property
    def needs_darkness(self) -> bool:
        """Whether the noise depends on how much light there is."""
        return self.gain > 0 or self.prnu > 0

    def variance_at(self, image: np.ndarray) -> np.ndarray:
        """Variance over repeated pictures (not sigma) of each pixel of a noise-free image, squared grey levels.

        EMVA 1288: sigma_dark^2 + gain (level - dark level) + 1/12, less near the end of the scale, which cuts it off.
        The fixed pattern does not vary.
        """
        return self._recorded(image)[1]

    def mean_at(self, image: np.ndarray) -> np.ndarray:
        """Mean over repeated pictures of each pixel of a noise-free image: itself but near the end of the scale."""
        return self._recorded(image)[0]

    def _recorded(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance of what the sensor records: a normal distribution cut off at 2^bits - 1.

        The cut at 0 is left out: the camera's black level keeps the noise away from it.
        """
        level = np.asarray(image, float)
        variance = self.variance + self.gain * np.maximum(level - self.dark_level, 0.0)
        full = np.inf if self.bits is None else 2.0**self.bits - 1
        near = level > full - 6 * np.sqrt(variance)
        if not near.any():
            return level, variance
        sigma = np.sqrt(variance[near])
        below = (full - level[near]) / sigma
        density = np.exp(-(below**2) / 2) / np.sqrt(2 * np.pi)
        missing = below * ndtr(below) + density  # mean of (full - x) / sigma where x is below, 0 elsewhere
        square = (1 + below**2) * ndtr(below) + below * density
        level, variance = level.copy(), variance.copy()
        level[near], variance[near] = full - sigma * missing, sigma**2 * np.maximum(square - missing**2, 0.0)
        return level, variance
