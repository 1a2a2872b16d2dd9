"""The noise of a recipe's sensor at the levels that a picture shows. NumPy alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from imaging.cut_off import MARGIN, cut_off


class Seen(NamedTuple):
    """Grey levels (P,) of the pixels of a picture that are read, how many are at the end of the scale, and the variance
    of their noise where it is the same of all, else None."""

    levels: np.ndarray
    saturated: int
    variance: float | None


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

    def seen(self, levels: np.ndarray) -> Seen:
        """What is told of levels (P,) as recorded."""
        brightest, ends = levels.max(initial=0), self.full - 0.5
        saturated = np.count_nonzero(levels >= ends) if brightest >= ends else 0
        return Seen(levels.astype(float), int(saturated), self.noise_variance if self._is_even(brightest) else None)

    def variance(self, levels: np.ndarray) -> np.ndarray | float:
        """Variance of the noise at grey levels (n,); one number where it is the same at all of them."""
        if self._is_even(levels.max()):
            return self.noise_variance
        variance = self.noise_variance + self.shot_gain * np.maximum(levels - self.dark_level, 0.0)
        near = levels > self.full - MARGIN * np.sqrt(variance)
        if near.any():
            variance[near] = cut_off(levels[near], variance[near], self.full, _normal)[1]
        return variance

    def _is_even(self, brightest: float) -> bool:
        """Whether noise is the same at all levels up to one."""
        return self.shot_gain == 0 and brightest <= self.full - MARGIN * math.sqrt(self.noise_variance)


def _normal(values: np.ndarray) -> np.ndarray:
    """The standard normal distribution function of a few values (n,)."""
    return np.array([math.erfc(-value / math.sqrt(2)) / 2 for value in values.tolist()])
