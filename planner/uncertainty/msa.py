"""Measurement system analysis: a crossed study of operators, parts and repeats, predicted, and tested by its variances.

The model is that of the AIAG manual (4th edition, ANOVA method): a value is the sum of independent effects of the part,
of the operator, of both together, and of the single repeat. Mean squares of a balanced study, over their expectations,
are chi-square over degrees of freedom, independent of each other; so each component is tested by a ratio of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special

from planner.uncertainty.checks import check_positive
from planner.uncertainty.risks import Limits, Risks, global_risks
from scenes import InvalidInput

NDC = 1.41  # distinct categories: so many times parts' spread over that of the measurement (AIAG)
COMPONENTS = ("repeats", "operators x parts", "operators", "parts")


@dataclass(frozen=True)
class Components:
    """Standard deviations (not variances) of the four effects, of one unit.

    Attributes
    ----------
    repeats : float
        From one repeat to the next (equipment variation, EV).
    both : float
        Of operator and part together.
    operators : float
    parts : float or None
        Of the manufacture; None where it is not known.
    """

    repeats: float
    both: float
    operators: float
    parts: float | None

    @property
    def appraisers(self) -> float:
        """Reproducibility (appraiser variation, AV): of operators, also with parts."""
        return math.hypot(self.operators, self.both)

    @property
    def grr(self) -> float:
        """Repeatability and reproducibility together."""
        return math.hypot(self.repeats, self.appraisers)

    @property
    def total(self) -> float | None:
        return None if self.parts is None else math.hypot(self.grr, self.parts)

    @property
    def grr_of_total(self) -> float | None:
        """%GRR of the study's total spread, a part of one."""
        return self.grr / self.total if self.total else None

    def grr_of(self, width: float) -> float:
        """%GRR of a tolerance's whole width: six standard deviations over it, a part of one."""
        check_positive("width", width)
        return 6 * self.grr / width

    @property
    def ndc(self) -> int | None:
        """Number of distinct categories, at least 1 (AIAG); None where parts' spread is not known, or GRR is 0."""
        return max(int(NDC * self.parts / self.grr), 1) if self.parts is not None and self.grr > 0 else None

    def mean_squares(self, operators: int, parts: int, repeats: int) -> np.ndarray:
        """Expectations of a study's mean squares, in the order of `COMPONENTS`, (4,); NaN of parts not known."""
        one = self.repeats**2
        both = one + repeats * self.both**2
        spread = np.nan if self.parts is None else self.parts
        return np.array([one, both, both + parts * repeats * self.operators**2, both + operators * repeats * spread**2])


@dataclass(frozen=True, eq=False)
class Study:
    """A balanced study: ``values`` (o, p, r) of o operators, p parts, r repeats, at least 2 each."""

    values: np.ndarray

    def __post_init__(self) -> None:
        shape = np.shape(self.values)
        if len(shape) != 3 or min(shape) < 2 or not np.isfinite(self.values).all():
            raise InvalidInput(
                "a study must have at least 2 operators, 2 parts and 2 repeats, each as often as the others, got"
                f" {' x '.join(map(str, shape))} values"
            )

    @property
    def dof(self) -> np.ndarray:
        """Degrees of freedom of the mean squares, in the order of `COMPONENTS`, (4,)."""
        o, p, r = self.values.shape
        return np.array([o * p * (r - 1), (o - 1) * (p - 1), o - 1, p - 1])

    @property
    def mean_squares(self) -> np.ndarray:
        """In the order of `COMPONENTS`, (4,)."""
        o, p, r = self.values.shape
        cells, whole = self.values.mean(2), self.values.mean()
        rows, columns = cells.mean(1), cells.mean(0)
        beside = cells - rows[:, None] - columns + whole
        squares = [
            ((self.values - cells[..., None]) ** 2).sum(), r * (beside**2).sum(), p * r * ((rows - whole) ** 2).sum(),
            o * r * ((columns - whole) ** 2).sum(),
        ]  # fmt: skip
        return np.array(squares) / self.dof

    @property
    def components(self) -> Components:
        """Estimates by the method of moments; what comes out negative is 0."""
        o, p, r = self.values.shape
        one, both, operators, parts = self.mean_squares
        spread = [one, (both - one) / r, (operators - both) / (p * r), (parts - both) / (o * r)]
        return Components(*(math.sqrt(max(each, 0.0)) for each in spread))


@dataclass(frozen=True)
class Checked:
    """One component of a study beside its prediction.

    Attributes
    ----------
    name : str
        Of `COMPONENTS`.
    ratio, low, high : float
        Its mean square over the one below it, over the predicted ratio of both (of repeats the mean square over the
        predicted one), and the interval that holds the true value with a probability of 95 %; 1 where the prediction
        is right.
    p : float
        Probability of a ratio at least as large, were the prediction right.
    """

    name: str
    ratio: float
    low: float
    high: float
    p: float


def check(study: Study, predicted: Components) -> tuple[Checked, ...]:
    """Each component of a study against its prediction; parts only where their spread is predicted.

    Repeats by chi-square; operators with parts over repeats, operators and parts over operators with parts, by F, so
    that a component that is too large does not blame those above it.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> told = Components(1.0, 0.0, 0.0, 5.0)
    >>> values = 5 * rng.standard_normal((1, 10, 1)) + rng.standard_normal((3, 10, 3))
    >>> [row.name for row in check(Study(values), told) if row.p < 0.01]
    []
    >>> [row.name for row in check(Study(values + 3 * rng.standard_normal((3, 1, 1))), told) if row.p < 0.01]
    ['operators']
    """
    over = study.mean_squares / predicted.mean_squares(*study.values.shape)
    dof, rows = study.dof, []
    for k, below in enumerate((None, 0, 1, 1)):
        if not np.isfinite(over[k]):
            continue
        if below is None:
            ratio, ends = over[k], special.chdtri(dof[k], [0.975, 0.025]) / dof[k]
            p = special.chdtrc(dof[k], ratio * dof[k])
        else:
            ratio, ends = over[k] / over[below], special.fdtri(dof[k], dof[below], [0.025, 0.975])
            p = special.fdtrc(dof[k], dof[below], ratio)
        rows.append(Checked(COMPONENTS[k], float(ratio), float(ratio / ends[1]), float(ratio / ends[0]), float(p)))
    return tuple(rows)


def too_large(rows: tuple[Checked, ...], level: float = 0.01) -> tuple[str, ...]:
    """Names of components that are larger than predicted beyond chance; ``level``: that any is called so wrongly."""
    least = 1 - (1 - level) ** (1 / max(len(rows), 1))
    return tuple(row.name for row in rows if row.p < least)


@dataclass(frozen=True)
class Guard:
    """A guard band and what it costs: ``width`` inside both limits (negative: outside), ``cost`` a part."""

    width: float
    cost: float
    risks: Risks


def cheapest_guard(mean: float, spread: float, u: float, limits: Limits, accepted: float, rejected: float) -> Guard:
    """The guard band with which wrong decisions cost least.

    Parameters
    ----------
    mean, spread, u, limits
        As of `planner.uncertainty.risks.global_risks`.
    accepted, rejected : float
        What a bad part that is accepted costs, and a good one that is rejected; at least 0, of one currency.

    Examples
    --------
    >>> zone = Limits(-2.0, 2.0)
    >>> dear, cheap = (cheapest_guard(0, 1, 0.25, zone, cost, 1.0).width for cost in (100.0, 1.0))
    >>> round(dear, 2) > 0 > round(cheap, 2)
    True
    """
    check_positive("accepted", accepted)
    check_positive("rejected", rejected)
    half = (limits.upper - limits.lower) / 2

    def told(width: float) -> Guard:
        risks = global_risks(mean, spread, u, limits, Limits(limits.lower + width, limits.upper - width))
        return Guard(width, accepted * risks.wrong_acceptance + rejected * risks.wrong_rejection, risks)

    most, least = min(6 * u, 0.999 * half), -6 * u
    found = optimize.minimize_scalar(lambda width: told(width).cost, bounds=(least, most), method="bounded",
                                     options={"xatol": 1e-6 * u})  # fmt: skip
    return told(float(found.x))
