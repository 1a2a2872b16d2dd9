"""Wrong decisions: guard bands and the risks of accepting a bad part or rejecting a good one (JCGM 106)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from planner.uncertainty.checks import check_finite, check_not_negative, check_positive
from scenes.errors import InvalidInput
from scenes.measurands.measurands import Tolerance

_REACH = 38.0  # standard deviations: the normal density beyond is below the smallest number
_NODES = np.polynomial.legendre.leggauss(64)


@dataclass(frozen=True)
class Limits:
    """An interval of values; an end may be infinite (a one-sided tolerance).

    >>> Limits(9.98, 10.02).guarded(U=0.004)
    Limits(lower=9.984, upper=10.016)
    """

    lower: float
    upper: float

    def __post_init__(self) -> None:
        if not self.lower < self.upper:
            raise InvalidInput(f"limits must be a lower and a greater upper one, got {self.lower} and {self.upper}")

    @classmethod
    def of(cls, nominal: float, tolerance: Tolerance) -> Limits:
        """The limits of a drawing's tolerance."""
        return cls(nominal - tolerance.minus, nominal + tolerance.plus)

    def guarded(self, U: float, g: float = 1.0) -> Limits:
        """Acceptance limits inside by the guard band w = g U (ISO 14253-1; JCGM 106 8.3.2); negative g: outside.

        g = 1 is the band of a whole U; that of 5 % of wrong acceptance at the limit is 1.645 / k (0.82 at k = 2).

        Raises
        ------
        InvalidInput
            Where nothing is left between them.
        """
        check_not_negative("U", U)
        if not self.lower + g * U < self.upper - g * U:
            half = (self.upper - self.lower) / 2
            raise InvalidInput(f"guard band must be less than half of the tolerance, {half:.6g}, got {g * U:.6g}")
        return Limits(self.lower + g * U, self.upper - g * U)


@dataclass(frozen=True)
class Risks:
    """Probabilities, of one part taken from the process.

    Attributes
    ----------
    wrong_acceptance : float
        That it is outside the tolerance and accepted (consumer's global risk, JCGM 106 eq. 17).
    wrong_rejection : float
        That it is inside and rejected (producer's, eq. 19).
    conforming : float
        That it is inside.
    accepted : float
        That it is accepted.
    """

    wrong_acceptance: float
    wrong_rejection: float
    conforming: float
    accepted: float


def nonconforming_probability(value: float, u: float, tolerance: Limits) -> float:
    """Specific risk: that a part measured as `value` with standard uncertainty u is outside (JCGM 106 7.2, 9.3).

    Without knowledge of the process; with it, give the part's best estimate and u by both (JCGM 106 A.4.4).

    >>> round(nonconforming_probability(10.02, 0.004, Limits(9.98, 10.02)), 3)
    0.5
    """
    check_positive("u", u)
    below, above = (tolerance.lower - value) / u, (value - tolerance.upper) / u
    return float(special.ndtr(below) + special.ndtr(above))


def global_risks(mean: float, spread: float, u: float, tolerance: Limits, acceptance: Limits | None = None) -> Risks:
    """Risks of a normal process and normal measurement errors (JCGM 106 9.5).

    Parameters
    ----------
    mean, spread : float
        Of the process: the parts' mean and standard deviation.
    u : float
        Standard uncertainty of the measurement.
    tolerance, acceptance : Limits
        A part is good within the first, and accepted when measured within the second; the first where not given.

    Raises
    ------
    InvalidInput

    Notes
    -----
    The integral of the parts' density times the probability of acceptance, by 64-point Gauss-Legendre on pieces of
    one `spread`, and of one u near the acceptance limits.

    Examples
    --------
    >>> zone = Limits(-2.0, 2.0)
    >>> plain, guarded = (global_risks(0, 1, 0.25, zone, zone.guarded(0.5, g)) for g in (0, 1))
    >>> [round(100 * x, 2) for x in (plain.wrong_acceptance, plain.wrong_rejection)]
    [0.8, 1.49]
    >>> [round(100 * x, 2) for x in (guarded.wrong_acceptance, guarded.wrong_rejection)]
    [0.02, 10.03]
    """
    check_positive("u", u)
    check_positive("spread", spread)
    check_finite("mean", mean)
    acceptance = acceptance or tolerance
    low, high = ((end - mean) / spread for end in (tolerance.lower, tolerance.upper))
    taken = ((acceptance.lower - mean) / spread, (acceptance.upper - mean) / spread)
    noise = u / spread
    good = _mass(low, high, taken, noise)
    bad = _mass(-math.inf, low, taken, noise) + _mass(high, math.inf, taken, noise)
    rejected = _mass(low, high, (-math.inf, taken[0]), noise) + _mass(low, high, (taken[1], math.inf), noise)
    return Risks(bad, rejected, float(_between(low, high)), good + bad)


def _mass(low: float, high: float, taken: tuple[float, float], noise: float) -> float:
    """P(low < part < high, taken[0] < part + noise < taken[1]) of a standard normal part."""
    low, high = max(low, -_REACH, taken[0] - _REACH * noise), min(high, _REACH, taken[1] + _REACH * noise)
    if not low < high or not taken[0] < taken[1]:
        return 0.0
    edges = _pieces(low, high, [end for end in taken if math.isfinite(end)], noise)
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:] + edges[:-1])[:, None] / 2
    x = middle + half * _NODES[0]
    density = np.exp(-(x**2) / 2) / math.sqrt(2 * math.pi)
    return float((half * _NODES[1] * density * _between((taken[0] - x) / noise, (taken[1] - x) / noise)).sum())


def _pieces(low: float, high: float, ends: list[float], noise: float) -> np.ndarray:
    """Edges of pieces: steps of one where all is smooth, of the noise near where acceptance turns."""
    coarse = np.arange(-_REACH, _REACH + 1)
    fine = [end + noise * np.arange(-_REACH, _REACH + 1) for end in ends]
    inside = np.concatenate([coarse, *fine])
    return np.unique(np.concatenate([[low, high], inside[(inside > low) & (inside < high)]]))


def _between(low: np.ndarray | float, high: np.ndarray | float) -> np.ndarray:
    """Normal probability between two ends, precise in both tails."""
    flip = np.where(np.add(low, high) > 0, -1.0, 1.0)
    a, b = np.where(flip > 0, low, np.negative(high)), np.where(flip > 0, high, np.negative(low))
    return special.ndtr(b) - special.ndtr(a)
