"""Does the largest, or the smallest, of some measured numbers keep its limits? By the joint law of all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from imaging.models.extremes import drawn
from planner.uncertainty.conformity import COVERAGE, Decision
from scenes import InvalidInput, Tolerance
from scenes.status import OK, is_trusted


@dataclass(frozen=True, eq=False)
class ExtremeValue:
    """What is known of the largest or the smallest of n numbers that are normal about what was measured.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Measured.
    covariance : ndarray, shape (n, n)
        Of all that is not exactly known of them.
    sign : int
        +1 of the largest, -1 of the smallest.

    Examples
    --------
    >>> found = ExtremeValue(np.array([10.00, 9.99]), 0.01**2 * np.eye(2), 1)
    >>> print(f"{found.value:.3f} measured; between {found.interval()[0]:.3f} and {found.interval()[1]:.3f} in 95 %")
    10.000 measured; between 9.986 and 10.020 in 95 %
    """

    values: np.ndarray
    covariance: np.ndarray
    sign: int

    @property
    def value(self) -> float:
        """The extreme of the measured numbers: a point estimate, not a mean."""
        return self.sign * float(np.max(self.sign * self.values))

    @property
    def is_known(self) -> bool:
        """Whether there are values with a covariance."""
        return bool(np.isfinite(self.values).all() and np.isfinite(self.covariance).all())

    def interval(self, p: float = 0.95) -> tuple[float, float]:
        """Numbers between which the true one lies with a probability, as much beyond either."""
        if not 0 < p < 1:
            raise InvalidInput(f"p must be between 0 and 1, got {p}")
        low, high = np.quantile(self._draws, [(1 - p) / 2, (1 + p) / 2])
        return float(low), float(high)

    def decide(self, nominal: float, tolerance: Tolerance, k: float = COVERAGE, status: str = OK) -> Decision:
        """Whether it keeps its limits, as surely as a guard band of k standard deviations of a normal law says.

        Parameters are those of `planner.uncertainty.conformity.decide`, the values with their law in place of one.
        """
        if not k >= 0:
            raise InvalidInput(f"k must be at least 0, got {k}")
        if not (is_trusted(status) and self.is_known):
            return "undecided"
        low, high = nominal - tolerance.minus, nominal + tolerance.plus
        sure, below = float(special.ndtr(k)), self._draws < low
        above, kept = self._draws > high, (self._draws >= low) & (self._draws <= high)
        if kept.mean() >= sure:
            return "pass"
        return "fail" if max(below.mean(), above.mean()) > sure else "undecided"

    @property
    def _draws(self) -> np.ndarray:
        return self.sign * (self.sign * self.values + drawn(self.covariance)).max(1)
