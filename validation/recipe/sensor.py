"""The noise of a recipe's sensor at the levels that a picture shows. NumPy alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from imaging.cut_off import MARGIN, cut_off


@dataclass(frozen=True)
class Sensor:
    """As `scenes.Noise` says it, of independent pixels.

    Attributes
    ----------
    noise_variance : float
        Of a grey level in darkness.
    shot_gain : float
        Variance that light adds for a grey level of signal.
    dark_level : float
    full : float
        The highest grey level; infinite without digits.
    """

    noise_variance: float
    shot_gain: float
    dark_level: float
    full: float

    def variance(self, levels: np.ndarray) -> np.ndarray | float:
        """Variance of the noise at grey levels (n,); one number where it is the same at all of them."""
        if self.shot_gain == 0 and levels.max() <= self.full - MARGIN * math.sqrt(self.noise_variance):
            return self.noise_variance
        variance = self.noise_variance + self.shot_gain * np.maximum(levels - self.dark_level, 0.0)
        near = levels > self.full - MARGIN * np.sqrt(variance)
        if near.any():
            variance[near] = cut_off(levels[near], variance[near], self.full, _normal)[1]
        return variance

    def saturated(self, levels: np.ndarray) -> int:
        """How many of some pixels are at the end of the scale."""
        return int((levels >= self.full - 0.5).sum())


def _normal(values: np.ndarray) -> np.ndarray:
    """The standard normal distribution function of a few values (n,)."""
    return np.array([math.erfc(-value / math.sqrt(2)) / 2 for value in values.tolist()])
