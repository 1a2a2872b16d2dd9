"""What is told of each value beside it: its bias taken off, its status, U and decision. NumPy alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from planner.uncertainty.rule import decided


@dataclass(frozen=True)
class Coverage:
    """Student's factors of a coverage probability.

    Attributes
    ----------
    factors : tuple of float
        At 1, 2, ... degrees of freedom.
    normal : float
        At infinitely many.
    """

    factors: tuple[float, ...]
    normal: float

    def factor(self, dof: float) -> float:
        """At degrees of freedom rounded down (GUM G.4.1); beyond the table by its expansion in 1 / dof (Abramowitz and
        Stegun, 26.7.5)."""
        if math.isinf(dof):
            return self.normal
        whole = math.floor(dof * (1 + 1e-9))
        if whole <= len(self.factors):
            return self.factors[whole - 1]
        z, n = self.normal, float(whole)
        terms = (
            (z**3 + z) / 4,
            (5 * z**5 + 16 * z**3 + 3 * z) / 96,
            (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
            (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / 92160,
        )
        return z + sum(term / n ** (k + 1) for k, term in enumerate(terms))


@dataclass(frozen=True)
class Characteristic:
    """One number of a drawing, and its budget beside what a picture tells.

    Attributes
    ----------
    name, kind, unit : str
    nominal : float
    tolerance : (plus, minus) or None
        How far a value may be off.
    alone : bool
        Whether it is decided by itself.
    group : int
        Numbers of one measurand have one; they have a budget together or none.
    variance : float or None
        Of all sources but noise, the bias and the model, squared unit; None where it has no budget.
    fourth : float
        Sum over these sources of u^4 over their degrees of freedom.
    model : (constant, of sigma)
        Standard uncertainty by the estimator's model where no bias is taken off: a number, and a multiple of
        sigma.
    """

    name: str
    kind: str
    unit: str
    nominal: float
    tolerance: tuple[float, float] | None
    alone: bool
    group: int
    variance: float | None
    fourth: float
    model: tuple[float, float]

    def expanded(self, sigma: float, u_bias: float | None, coverage: Coverage) -> float | None:
        """U of a value of a standard deviation by noise and of a bias' standard uncertainty; None of either: no bias
        was taken off, or it has no budget."""
        if self.variance is None:
            return None
        doubt = self.model[0] + self.model[1] * sigma if u_bias is None else u_bias if math.isfinite(u_bias) else 0.0
        whole = self.variance + sigma**2 + doubt**2
        dof = whole**2 / self.fourth if self.fourth > 0 else math.inf
        return coverage.factor(dof) * math.sqrt(whole)

    def decided(self, value: float, U: float | None, state: str) -> str | None:
        """``pass``, ``fail`` or ``undecided`` (ISO 14253-1); None without a tolerance of its own."""
        if self.tolerance is None or not self.alone:
            return None
        plus, minus = self.tolerance
        return decided(value, (self.nominal - minus, self.nominal + plus), math.inf if U is None else U, state)


def with_budget(characteristics: Sequence[Characteristic], sigmas: Sequence[float], whole: bool) -> list[bool]:
    """Which of values with standard deviations by noise have a budget: those of measurands all of whose numbers are
    measured. ``whole``: all or none."""
    good = [each.variance is not None and math.isfinite(s) for each, s in zip(characteristics, sigmas, strict=True)]
    lost = {each.group for each, there in zip(characteristics, good, strict=True) if not there}
    there = [each.group not in lost for each in characteristics]
    return [False] * len(there) if whole and not all(good) else there


def known(value: Any) -> float | None:
    """A number, None where it is not finite."""
    return float(value) if math.isfinite(value) else None
