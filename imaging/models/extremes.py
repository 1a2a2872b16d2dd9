"""The law of an extreme of jointly normal numbers: the largest, the smallest, or the range between both.

It is not normal where several numbers may be the extreme one. Draws of the numbers tell it: always the same, of a
scrambled Sobol sequence, so that what is told of a picture is told alike each time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy import special, stats

DRAWS = 8192  # a power of 2, as Sobol's sequence wants
Extreme = Callable[[np.ndarray], np.ndarray]
"""Of numbers (..., m) along the last axis."""


@dataclass(frozen=True, eq=False)
class Law:
    """What draws tell of a number.

    Attributes
    ----------
    draws : ndarray, shape (n,)
        Values, equally likely.

    Examples
    --------
    >>> largest = Law.of(np.zeros(2), np.eye(2), lambda x: x.max(-1))
    >>> print(f"{largest.mean:.3f} {largest.u:.3f} {largest.quantile(0.95):.2f}")  # 1 / sqrt(pi) = 0.564
    0.564 0.826 1.95
    """

    draws: np.ndarray

    @classmethod
    def of(cls, mean: np.ndarray, covariance: np.ndarray, extreme: Extreme) -> Law:
        """Of an extreme of m numbers with means (m,) and joint covariance (m, m)."""
        return cls(extreme(mean + drawn(covariance)))

    @cached_property
    def mean(self) -> float:
        """Expected value."""
        return float(self.draws.mean())

    @cached_property
    def u(self) -> float:
        """Standard deviation."""
        return float(self.draws.std())

    @cached_property
    def _ordered(self) -> np.ndarray:
        return np.sort(self.draws)

    def quantile(self, p: float) -> float:
        """Value that is not exceeded with a probability, 0 < p < 1."""
        return float(np.quantile(self._ordered, p))

    def below(self, value: float) -> float:
        """Probability of at most so much."""
        return float(np.searchsorted(self._ordered, value, side="right") / self._ordered.size)


def drawn(covariance: np.ndarray) -> np.ndarray:
    """Errors of m jointly normal numbers, shape (`DRAWS`, m)."""
    squares, axes = np.linalg.eigh(covariance)
    kept = squares > 1e-12 * max(float(squares[-1]), 0.0)
    return unit_normals(int(kept.sum())) @ (axes[:, kept] * np.sqrt(squares[kept])).T


@lru_cache(maxsize=64)
def unit_normals(count: int) -> np.ndarray:
    """Independent standard normal numbers, shape (`DRAWS`, count)."""
    if count == 0:
        return np.zeros((DRAWS, 0))
    uniform = stats.qmc.Sobol(count, scramble=True, rng=np.random.default_rng(0)).random(DRAWS)
    return special.ndtri(np.clip(uniform, 1e-16, 1 - 1e-16))


def spread(numbers: np.ndarray) -> np.ndarray:
    """The largest less the smallest of numbers (..., m)."""
    return np.ptp(numbers, axis=-1)


def magnitude(numbers: np.ndarray) -> np.ndarray:
    """Twice the largest magnitude of numbers (..., m): the zone about 0 that holds them."""
    return 2 * np.abs(numbers).max(-1)
