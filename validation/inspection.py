"""An inspection: what pictures of a part say of each characteristic of its drawing, with U and decision."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planner.budgeting.budgets import SceneBudget
from planner.uncertainty.conformity import Decision, decide
from planner.uncertainty.extremes import ExtremeValue
from scenes.measurands.zone import joint_parts
from scenes.results import finite
from scenes.status import is_trusted
from validation.report.requirements import Requirement, measurable_budget, requirements
from validation.zones import MeasuredZone, measured_extremes, measured_zones

if TYPE_CHECKING:
    import measure


@dataclass(frozen=True)
class Inspected:
    """A characteristic as it was measured.

    Attributes
    ----------
    requirement : Requirement
        Its balloon's number, name, nominal value, tolerance, U and status.
    value : float or None
        Its bias taken off; None where it could not be measured.
    u : float or None
        Combined standard uncertainty, of which U is a multiple; None where there is no U.
    decision : {"pass", "fail", "undecided"} or None
        By U (ISO 14253-1); None without a tolerance, and of what is decided with others (`Inspection.zones`).
    picture : int
        In which, from 1.
    """

    requirement: Requirement
    value: float | None
    u: float | None
    decision: Decision | None
    picture: int = 1

    @property
    def limits(self) -> tuple[float, float] | None:
        """Of what is accepted; None without a tolerance."""
        told = self.requirement
        zone = told.tolerance
        return None if zone is None else (told.nominal - zone.minus, told.nominal + zone.plus)


@dataclass(frozen=True, eq=False)
class Taken:
    """All characteristics in one picture of a part, and the budget of those that could be measured."""

    found: measure.Measurements
    rows: tuple[Inspected, ...]
    budget: SceneBudget | None
    zones: tuple[MeasuredZone, ...]


@dataclass(frozen=True, eq=False)
class Inspection:
    """All characteristics of one part: ``rows`` are each of the picture that tells it best, of all that were taken."""

    taken: tuple[Taken, ...]
    rows: tuple[Inspected, ...]

    @property
    def zones(self) -> tuple[MeasuredZone, ...]:
        """Tolerances that several numbers, or all points, keep together, each of the picture that tells it best."""
        return tuple(min(each, key=_doubt_of_zone) for each in zip(*(one.zones for one in self.taken), strict=True))

    @property
    def forms(self) -> dict[str, MeasuredZone]:
        """The zones of forms, by the names of the rows that they stand for."""
        return {each.zone.name: each for each in self.zones if each.zone.is_form}

    def found(self, row: Inspected) -> measure.Measurements:
        """What was measured in a row's picture."""
        return self.taken[row.picture - 1].found

    @property
    def covariance(self) -> np.ndarray:
        """Joint covariance (M, M) of the rows' values by noise: 0 between values of different pictures."""
        each = np.array([taken.found.covariance for taken in self.taken])
        which = np.array([row.picture - 1 for row in self.rows])
        return np.where(which[:, None] == which, each[which, np.arange(len(which))], 0.0)

    @property
    def decision(self) -> Decision | None:
        """Of the part: ``fail`` by one characteristic, ``pass`` by all that have a tolerance; None where none has.

        A zone's numbers are decided together.
        """
        each = [one.decision for one in (*self.rows, *self.zones) if one.decision is not None]
        if not each:
            return None
        return "fail" if "fail" in each else "undecided" if "undecided" in each else "pass"


def inspect(*found: measure.Measurements) -> Inspection:
    """The inspection of a part of which one picture, or several of one scene, have been measured.

    Each characteristic is told by the picture in which it is ``ok`` with the least U; where in none, with the least
    sigma. Without U, and undecided, where no light is known. U holds all that the scene says is not exact: noise and
    the correction's doubt as measured, camera, places, temperature (`planner.budgeting.budgets.budget`).
    """
    taken = tuple(_taken(each, number) for number, each in enumerate(found, 1))
    every = zip(*(each.rows for each in taken), strict=True)
    return Inspection(taken, tuple(min(rows, key=_doubt) for rows in every))


def _doubt(row: Inspected) -> tuple[bool, bool, float, float]:
    """What is least of the picture that tells a characteristic best."""
    told = row.requirement
    U = np.inf if told.U is None else told.U
    return not is_trusted(told.status), row.value is None, U, told.sigma


def _doubt_of_zone(zone: MeasuredZone) -> tuple[bool, float]:
    """The same of a zone: the one of which least is left open."""
    return not is_trusted(zone.status), zone.size.quantile(0.95) - zone.size.value if zone.size.is_known else np.inf


def _taken(found: measure.Measurements, number: int) -> Taken:
    known = expanded(found)
    told = _requirements(found, known) if found.picture.lights else _unlit(found)
    joint = joint_parts(found.picture.scene.zones)
    rows = (_inspected(each, float(value), known, number) for each, value in zip(told, found.value, strict=True))
    alone = (replace(row, decision=None) if row.requirement.name in joint else row for row in rows)
    extremes = measured_extremes(found, known)
    decided = (_by_law(row, extremes[row.requirement.name]) if row.requirement.name in extremes else row
               for row in alone)  # fmt: skip
    return Taken(found, tuple(decided), known, measured_zones(found, known))


def _by_law(row: Inspected, extreme: ExtremeValue) -> Inspected:
    """Decided by the joint law of the numbers of which it is the largest or the smallest."""
    told = row.requirement
    zone = told.tolerance
    return row if zone is None else replace(row, decision=extreme.decide(told.nominal, zone, status=told.status))


def expanded(found: measure.Measurements) -> SceneBudget | None:
    """The budget of what was measured in one picture, with its own noise and, where its bias was taken off, the doubt
    of that; None where no light is known, or nothing could be measured."""
    if not found.picture.lights:
        return None
    doubts = {} if np.isnan(found.u_bias).all() else {"doubts": np.nan_to_num(found.u_bias, nan=np.inf, posinf=np.inf)}
    variances = np.einsum("mm->m", found.covariance)
    return measurable_budget(found.picture, statuses=[str(s) for s in found.status], variances=variances, **doubts)


def _requirements(found: measure.Measurements, known: SceneBudget | None) -> tuple[Requirement, ...]:
    return requirements(
        found.picture,
        sigmas=found.sigma.tolist(),
        biases=[0.0 if np.isfinite(u) else None for u in found.u_bias],
        found=known,
        statuses=[str(state) for state in found.status],
        u_biases=[finite(u) for u in found.u_bias],
    )


def _unlit(found: measure.Measurements) -> tuple[Requirement, ...]:
    """Where no light is known nothing is known of biases: without U."""
    return tuple(
        Requirement(
            number=m + 1, name=quantity.name, unit=found.units[m], nominal=float(found.nominal[m]),
            tolerance=quantity.tolerance, sigma=float(found.sigma[m]), bias=None, u_bias=None, U=None,
            status=str(found.status[m]), limits="", kind=quantity.kind,
        )
        for m, quantity in enumerate(found.quantities)
    )  # fmt: skip


def _inspected(told: Requirement, value: float, known: SceneBudget | None, number: int) -> Inspected:
    u = None if told.U is None or known is None else known[told.name].u
    zone = told.tolerance
    U = np.inf if told.U is None else told.U
    decision = zone and decide(value, U, told.nominal, zone, k=1.0, status=told.status)
    return Inspected(told, finite(value), u, decision, number)
