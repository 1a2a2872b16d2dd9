"""Measurement system analysis: a crossed study of operators, parts and repeats, predicted, and tested by its variances.

The model is that of the AIAG manual (4th edition, ANOVA method): a value is the sum of independent effects of the part,
of the operator, of both together, and of the single repeat. Mean squares of a balanced study, over their expectations,
are chi-square over degrees of freedom, independent of each other; so each component is tested by a ratio of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from scipy import optimize, special

from planner.uncertainty.checks import check_positive
from planner.uncertainty.risks import Limits, Risks, global_risks
from scenes import InvalidInput

NDC = 1.41  # distinct categories: so many times parts' spread over that of the measurement (AIAG)
COMPONENTS = ("repeats", "operators x parts", "operators", "parts")
_FIELDS = ("repeats", "both", "operators", "parts")  # of `Components`, in that order
CUSTOMARY = (3, 10, 3)  # operators, parts, repeats of AIAG's study
LEVEL = 0.01  # that any component of a study as predicted is called too large
LARGEST = (40, 60, 5)  # operators, parts, repeats of a study that can be made


Count: TypeAlias = "int | np.ndarray"


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

    def mean_squares(self, operators: Count, parts: Count, repeats: Count) -> np.ndarray:
        """Expectations of a study's mean squares, in the order of `COMPONENTS`, (4, ...); NaN of parts not known."""
        one = self.repeats**2
        both = one + repeats * self.both**2
        spread = np.nan if self.parts is None else self.parts
        rows = one, both, both + parts * repeats * self.operators**2, both + operators * repeats * spread**2
        return np.array(np.broadcast_arrays(*rows))


def degrees_of_freedom(operators: Count, parts: Count, repeats: Count) -> np.ndarray:
    """Of a study's mean squares, in the order of `COMPONENTS`, (4, ...)."""
    o, p, r = np.broadcast_arrays(operators, parts, repeats)
    return np.array([o * p * (r - 1), (o - 1) * (p - 1), o - 1, p - 1])


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
        return degrees_of_freedom(*self.values.shape)

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


def too_large(rows: tuple[Checked, ...], level: float = LEVEL) -> tuple[str, ...]:
    """Names of components that are larger than predicted beyond chance; ``level``: that any is called so wrongly."""
    return tuple(row.name for row in rows if row.p < _of_one(level, len(rows)))


def _of_one(level: float, tests: int) -> float:
    """The level of each of some independent tests that have this one together (Sidak)."""
    return 1 - (1 - level) ** (1 / max(tests, 1))


def found_by(
    predicted: Components, operators: Count, parts: Count, repeats: Count, times: float = 2.0
) -> dict[str, np.ndarray]:
    """How likely a study names a component (`too_large`) that is larger than predicted, by component, each (...).

    Parameters
    ----------
    predicted : Components
        Those that are 0 or not known are left out.
    operators, parts, repeats : int or ndarray
        Of the study, at least 2 each; arrays broadcast.
    times : float
        So many times the predicted standard deviation, each component alone.

    Examples
    --------
    >>> told = Components(1.0, 0.5, 0.8, 4.0)
    >>> {name: round(float(p), 2) for name, p in found_by(told, 3, 10, 3).items()}
    {'repeats': 1.0, 'operators x parts': 0.32, 'operators': 0.13, 'parts': 0.36}
    """
    dof, expected = degrees_of_freedom(operators, parts, repeats), predicted.mean_squares(operators, parts, repeats)
    least, found = _of_one(LEVEL, 3 if predicted.parts is None else 4), {}
    for k, (name, key, below) in enumerate(zip(COMPONENTS, _FIELDS, (None, 0, 1, 1), strict=True)):
        own = getattr(predicted, key)
        if not own:
            continue
        larger = replace(predicted, **{key: times * own}).mean_squares(operators, parts, repeats)[k] / expected[k]
        if below is None:
            found[name] = special.chdtrc(dof[k], special.chdtri(dof[k], least) / larger)
        else:
            critical = special.fdtri(dof[k], dof[below], 1 - least)
            found[name] = special.fdtrc(dof[k], dof[below], critical / larger)
    return found


def smallest_study(predicted: Components, sure: float = 0.9, times: float = 2.0) -> tuple[int, int, int] | None:
    """Operators, parts and repeats of the study of fewest values that names each component which is so many times
    as large as predicted at least this likely (`found_by`); None where the `LARGEST` does not.

    Examples
    --------
    >>> smallest_study(Components(1.0, 0.5, 0.8, 4.0))
    (19, 18, 2)
    """
    o, p, r = np.ogrid[2 : LARGEST[0] + 1, 2 : LARGEST[1] + 1, 2 : LARGEST[2] + 1]
    likely = found_by(predicted, o, p, r, times)
    good = np.min(list(likely.values()), axis=0) >= sure if likely else np.ones((1, 1, 1), bool)
    values = np.where(good, o * p * r, np.inf)
    if not np.isfinite(values).any():
        return None
    at = np.unravel_index(np.argmin(values), values.shape)
    return int(at[0]) + 2, int(at[1]) + 2, int(at[2]) + 2


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
