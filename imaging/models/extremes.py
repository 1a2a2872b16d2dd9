"""The law of an extreme of jointly normal numbers: the largest, the smallest, or the range between both.

It is not normal where several numbers may be the extreme one. Draws of the numbers tell it: always the same, of a
scrambled Sobol sequence, so that what is told of a picture is told alike each time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy import special

from scenes import Quantity
from scenes.measurands.kinds import MEASURANDS

DRAWS = 8192  # a power of 2, as Sobol's sequence wants
_ROOT = np.sqrt(2 * np.pi)
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
    >>> print(f"{largest.mean:.3f} {largest.u:.3f} {largest.quantile(0.95):.1f}")  # 1 / sqrt(pi) = 0.564
    0.564 0.826 2.0
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


def extremes_of(quantities: Sequence[Quantity]) -> Iterator[tuple[int, list[int], int]]:
    """Of each quantity that is an extreme of others its place, theirs, and +1 for the largest, -1 for the smallest."""
    names = [quantity.name for quantity in quantities]
    for m, quantity in enumerate(quantities):
        if MEASURANDS[quantity.kind].extreme:
            yield m, [names.index(term.name) for term in quantity.terms], MEASURANDS[quantity.kind].extreme


def with_extremes(
    quantities: Sequence[Quantity], values: np.ndarray, gradient: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (M, q) and covariance (M, M) in which extremes among M quantities have their own law.

    The covariance of the largest with another normal number is that of each with it, times the probability that it is
    the largest (Stein's lemma); its variance that of the draws.

    Parameters
    ----------
    values : ndarray, shape (M,)
        About which the numbers are normal.
    gradient, covariance : ndarray, shapes (M, q) and (M, M)
        Of the numbers; of extremes whatever they are.
    """
    gradient, covariance = gradient.copy(), covariance.copy()
    for m, rows, sign in extremes_of(quantities):
        part = covariance[np.ix_(rows, rows)]
        if not (np.isfinite(values[rows]).all() and np.isfinite(part).all()):
            continue
        shares, variance = of_largest(sign * values[rows], part)
        gradient[m] = shares @ gradient[rows]
        with np.errstate(invalid="ignore"):
            covariance[m] = covariance[:, m] = shares @ covariance[rows]
        covariance[m, m] = variance
    return gradient, covariance


def of_largest(mean: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, float]:
    """Probabilities (n,) that each of n jointly normal numbers is the largest, and the variance of that.

    Draws tell by how much it exceeds the variance of the numbers' mean with those weights.
    """
    each = mean + drawn(covariance)
    shares = np.bincount(each.argmax(1), minlength=len(mean)) / len(each)
    beside = each.max(1).var() - (each @ shares).var()
    return shares, float(shares @ covariance @ shares + max(beside, 0.0))


def largest_moments(mean: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance (...) of the largest of n jointly normal numbers, means (..., n), covariance (..., n, n).

    Clark (1961): exact of two; of more, one after the other, as if the largest of those before were normal.

    Examples
    --------
    >>> [round(float(each), 4) for each in largest_moments(np.zeros(2), np.eye(2))]
    [0.5642, 0.6817]
    """
    best, square = mean[..., 0], covariance[..., 0, 0]
    beside = covariance[..., 0, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        for k in range(1, mean.shape[-1]):
            other, variance = mean[..., k], covariance[..., k, k]
            apart = np.sqrt(np.maximum(square + variance - 2 * beside[..., k], 0.0))
            away = np.where(apart > 0, (best - other) / apart, np.where(best >= other, np.inf, -np.inf))
            first, second, density = special.ndtr(away), special.ndtr(-away), np.exp(-(away**2) / 2) / _ROOT
            bump = np.where(apart > 0, apart * density, 0.0)
            new = best * first + other * second + bump
            moment = (square + best**2) * first + (variance + other**2) * second + (best + other) * bump
            best, square = new, np.maximum(moment - new**2, 0.0)
            beside = first[..., None] * beside + second[..., None] * covariance[..., k, :]
    return best, square


def drawn(covariance: np.ndarray) -> np.ndarray:
    """Errors of m jointly normal numbers, shape (`DRAWS`, m).

    By the symmetric root of their covariance (m, m): there is one, whichever axes of equal variances a library finds.
    """
    squares, axes = np.linalg.eigh(covariance)
    return unit_normals(len(covariance)) @ ((axes * np.sqrt(np.maximum(squares, 0.0))) @ axes.T)


@lru_cache(maxsize=4)  # of some hundred numbers 10 MB each
def unit_normals(count: int) -> np.ndarray:
    """Independent standard normal numbers, shape (`DRAWS`, count)."""
    if count == 0:
        return np.zeros((DRAWS, 0))
    from scipy.stats import qmc  # half a second to load, which scenes without extremes do not need

    uniform = qmc.Sobol(count, scramble=True, rng=np.random.default_rng(0)).random(DRAWS)
    return special.ndtri(np.clip(uniform, 1e-16, 1 - 1e-16))


def spread(numbers: np.ndarray) -> np.ndarray:
    """The largest less the smallest of numbers (..., m)."""
    return np.ptp(numbers, axis=-1)


def magnitude(numbers: np.ndarray) -> np.ndarray:
    """Twice the largest magnitude of numbers (..., m): the zone about 0 that holds them."""
    return 2 * np.abs(numbers).max(-1)
