"""The size of zone that a feature's edge points need: what may be said of it, and decided, whatever the form.

Points lie beside their reference by the form and by noise, s + n. For whichever form s

- the zone of s + n is at most that of s and that of n together, so that a measured zone is larger than the true one by
  more than a quantile of the zone of n alone with no more than that quantile's probability of being exceeded;
- it is at least what the two points need between which the zone of s lies, so that it is smaller than the true one by
  more than k standard deviations of two points' difference with no more than a normal number's probability.

No form has to be assumed for either. The value, from which is taken what noise adds, lies between both. What the points
do not show is in neither: a piece beyond the search window makes the form a ``misfit``; what is narrower than the
locator's Gaussian, some 4 px, is smoothed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from imaging.models.form_law import FormLaw
from planner.uncertainty.conformity import COVERAGE, Decision
from scenes import InvalidInput
from scenes.status import OK, is_trusted


@dataclass(frozen=True, eq=False)
class FormSize:
    """What is known of the zone that a form needs, the scene's unit.

    Attributes
    ----------
    value : float
        What noise adds taken off, and a bias that a simulation tells.
    u : float
        Standard deviation of that by noise and by all else; NaN where it is not known.
    seen : float
        Zone that the points as found need, the same bias taken off.
    law : FormLaw or None
        Of their errors; None where the form was not found.
    beside : float
        Standard uncertainty of all but noise.

    Examples
    --------
    >>> law = FormLaw.beside(0.01**2 * np.eye(60), np.ones((60, 1)), "line", np.arange(60))
    >>> found = FormSize(value=0.004, u=0.007, seen=0.050, law=law)
    >>> low, high = found.interval()
    >>> print(f"from {low:.3f} to {high:.3f}: {found.decide(0.02)} of 0.02, {found.decide(0.1)} of 0.1")
    from 0.000 to 0.078: undecided of 0.02, pass of 0.1
    """

    value: float
    u: float
    seen: float
    law: FormLaw | None
    beside: float = 0.0

    @property
    def is_known(self) -> bool:
        """Whether there is a value with a law."""
        return self.law is not None and bool(np.isfinite([self.value, self.u, self.seen, self.beside]).all())

    @property
    def mean(self) -> float:
        """The value: what noise adds is taken off it."""
        return self.value

    def quantile(self, p: float) -> float:
        """Size that the true one exceeds with a probability of no more than 1 - p, or, below 1/2, falls short of with
        no more than p."""
        if not 0 < p < 1:
            raise InvalidInput(f"p must be between 0 and 1, got {p}")
        if self.law is None:
            return np.nan
        k = float(special.ndtri(p))
        if p >= 0.5:
            return self.seen + k * float(np.hypot(self.law.apart, self.beside))
        return max(self.seen - self.law.noise.quantile(1 - p) + k * self.beside, 0.0)

    def interval(self, p: float = 0.95) -> tuple[float, float]:
        """Sizes between which the true one lies with a probability of at least p."""
        return self.quantile((1 - p) / 2), self.quantile((1 + p) / 2)

    def decide(self, limit: float, k: float = COVERAGE, status: str = OK) -> Decision:
        """Whether it keeps a drawing's size, as surely as a guard band of k standard deviations of a normal law says.

        A parameter's meaning is that of `ZoneSize.decide`.
        """
        if not k >= 0:
            raise InvalidInput(f"k must be at least 0, got {k}")
        if not (is_trusted(status) and self.is_known):
            return "undecided"
        sure = min(float(special.ndtr(k)), 1 - 1e-6)
        if self.quantile(sure) <= limit:
            return "pass"
        return "fail" if self.quantile(1 - sure) > limit else "undecided"
