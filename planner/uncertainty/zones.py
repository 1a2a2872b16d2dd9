"""The size of the zone that a measured deviation needs (ISO 1101): not normal near 0, and decided by its own law.

A position is off by a way v in a plane, of which a measurement tells components and covariance; the zone's diameter is
2 |v|. Where |v| is no more than a few standard deviations a propagated standard deviation says nothing of it: the
derivative of |v| does not exist at 0, and the mean is not 0. What is known is that v is normal about what was measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import special

from planner.uncertainty.conformity import COVERAGE, Decision
from scenes import InvalidInput
from scenes.status import OK, is_trusted

REACH = 9.0  # standard deviations: less than 1e-18 is beyond
_ANGLES, _WEIGHTS = np.polynomial.legendre.leggauss(160)


@dataclass(frozen=True, eq=False)
class ZoneSize:
    """What is known of factor |v|, v of one component, or of two at right angles, being normal about what was measured.

    Attributes
    ----------
    off : ndarray, shape (k,)
        Measured deviations from the true place, k = 1 or 2.
    covariance : ndarray, shape (k, k)
        Of these, with what is not known of a bias.
    factor : float
        Size over |v|: 2 of a zone about a true place.

    Examples
    --------
    >>> found = ZoneSize(np.zeros(2), np.diag([0.01**2, 0.01**2]), 2.0)
    >>> print(f"{found.value:.3f} measured; mean {found.mean:.4f}, below {found.quantile(0.95):.4f} in 95 %")
    0.000 measured; mean 0.0251, below 0.0490 in 95 %
    """

    off: np.ndarray
    covariance: np.ndarray
    factor: float = 1.0

    def __post_init__(self) -> None:
        shape = np.shape(self.off)
        if shape not in ((1,), (2,)) or np.shape(self.covariance) != (*shape, *shape):
            raise InvalidInput(
                f"off and covariance must be of one or two components, got {shape} and {np.shape(self.covariance)}"
            )

    @property
    def value(self) -> float:
        """Size that the measured deviation needs: of a point estimate, not a mean."""
        return self.factor * float(np.linalg.norm(self.off))

    @property
    def is_known(self) -> bool:
        """Whether there is a value with a covariance."""
        return bool(np.isfinite(self.off).all() and np.isfinite(self.covariance).all())

    def below(self, size: float) -> float:
        """Probability that the true size is at most so much."""
        radius = size / self.factor
        return 0.0 if radius < 0 else self._within(radius)

    @cached_property
    def mean(self) -> float:
        """Of the law: at least `value`, and not 0 where that is."""
        middles, sigmas = self._principal
        low, high = self._reach
        beside = [each for each in np.abs(middles) if low < each < high]  # a nearly exact component starts there
        borders = np.array([low, *sorted(beside), high])
        first, last = borders[:-1, None], borders[1:, None]
        nodes = ((first + last) / 2 + (last - first) / 2 * np.sin(np.pi / 2 * _ANGLES)).ravel()
        weights = (np.pi / 2 * np.cos(np.pi / 2 * _ANGLES) * _WEIGHTS * (last - first) / 2).ravel()
        beyond = 1 - within(nodes, np.tile(middles, (nodes.size, 1)), sigmas)
        return self.factor * (low + float(weights @ beyond))

    @property
    def u(self) -> float:
        """Standard deviation of the law."""
        square = float(self.off @ self.off + np.trace(self.covariance))
        return self.factor * math.sqrt(max(square - (self.mean / self.factor) ** 2, 0.0))

    def quantile(self, p: float) -> float:
        """Size that is not exceeded with a probability, 0 < p < 1."""
        if not 0 < p < 1:
            raise InvalidInput(f"p must be between 0 and 1, got {p}")
        from scipy import optimize  # slow to load, and rarely needed

        low, high = self._reach
        if high <= low:
            return self.factor * low
        return self.factor * float(optimize.brentq(lambda r: self._within(r) - p, low, high, xtol=1e-13 * high))

    def interval(self, p: float = 0.95) -> tuple[float, float]:
        """Sizes between which the true one lies with a probability, as much beyond either."""
        return self.quantile((1 - p) / 2), self.quantile((1 + p) / 2)

    def decide(self, limit: float, k: float = COVERAGE, status: str = OK) -> Decision:
        """Whether it keeps a drawing's size, as surely as a guard band of k standard deviations of a normal law says.

        Parameters
        ----------
        limit : float
            Diameter or width of the zone on the drawing.
        k : float
            Coverage factor, at least 0: a probability of 97.7 % at 2.
        status : str
            Of the value (`scenes.status`); what is not trusted is undecided.
        """
        if not k >= 0:
            raise InvalidInput(f"k must be at least 0, got {k}")
        if not (is_trusted(status) and self.is_known):
            return "undecided"
        kept, wanted = self.below(limit), float(special.ndtr(k))
        return "pass" if kept >= wanted else "fail" if kept < 1 - wanted else "undecided"

    @cached_property
    def _principal(self) -> tuple[np.ndarray, np.ndarray]:
        """Deviations along the covariance's axes, and standard deviations, the least first."""
        squares, axes = np.linalg.eigh(self.covariance)
        return axes.T @ self.off, np.sqrt(np.maximum(squares, 0.0))

    @property
    def _reach(self) -> tuple[float, float]:
        """Lengths of v between which all of the law is."""
        away, most = float(np.linalg.norm(self.off)), REACH * float(self._principal[1][-1])
        return max(away - most, 0.0), away + math.sqrt(len(self.off)) * most

    def _within(self, radius: float) -> float:
        """Probability of |v| <= radius."""
        middles, sigmas = self._principal
        return float(within(np.array([radius]), middles[None], sigmas)[0])


def within(radius: np.ndarray, middles: np.ndarray, sigmas: np.ndarray) -> np.ndarray:
    """Probability of |v| <= radius: of two components by the one that scatters least, given it of the other.

    Parameters
    ----------
    radius : ndarray, shape (n,)
    middles : ndarray, shape (n, k)
        Means of the k components, 1 or 2, which are independent, the one that scatters least first.
    sigmas : ndarray, shape (k,)
        Their standard deviations.

    Returns
    -------
    ndarray, shape (n,)
    """
    middle, wide, radius = middles[:, -1], sigmas[-1], np.asarray(radius, float)
    if len(sigmas) == 1:
        return np.where(radius < 0, 0.0, _inside(np.maximum(radius, 0.0), middle, wide))
    beside, narrow = middles[:, 0], sigmas[0]
    low, high = np.maximum(-radius, beside - REACH * narrow), np.minimum(radius, beside + REACH * narrow)
    if narrow == 0:
        told = _inside(np.sqrt(np.maximum(radius**2 - beside**2, 0.0)), middle, wide)
        return np.where((low > high) | (radius < 0), 0.0, told)
    low, high = low[:, None], np.maximum(high, low)[:, None]
    turn = np.pi / 2 * _ANGLES  # by its sine, for a chord's length falls like a root at the circle's ends
    at = (low + high) / 2 + (high - low) / 2 * np.sin(turn)
    step = np.pi / 2 * _WEIGHTS * (high - low) / 2 * np.cos(turn)
    density = np.exp(-0.5 * ((at - beside[:, None]) / narrow) ** 2) / (math.sqrt(2 * math.pi) * narrow)
    chord = np.sqrt(np.maximum(radius[:, None] ** 2 - at**2, 0.0))
    return np.minimum((step * density * _inside(chord, middle[:, None], wide)).sum(-1), 1.0)


def _inside(half: np.ndarray, mean: float, sigma: float) -> np.ndarray:
    """Probability that a normal number lies within -half ... half."""
    if sigma == 0:
        return (np.abs(mean) <= half).astype(float)
    return special.ndtr((half - mean) / sigma) - special.ndtr((-half - mean) / sigma)
