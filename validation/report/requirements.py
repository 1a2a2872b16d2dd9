"""The requirements of a drawing at one station: how well each is measured against its tolerance, and why not better."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

import planner
from planner.budgeting.budgets import SceneBudget, budget
from planner.uncertainty.budget import Budget
from scenes import InvalidInput, Picture, Tolerance
from scenes.results import finite
from scenes.status import MEASURED, is_trusted
from validation.report import cells, source_words

HALF = "half the tolerance zone"  # what U is compared with, in words
WELL = 0.25  # of it: a test uncertainty ratio of 4 to 1 (ANSI/NCSL Z540.3)


class Grade(StrEnum):
    """What the expanded uncertainty is against half of the tolerance zone: of the measurement, not of the part."""

    WELL = "precise enough"
    WITHIN = "usable"
    OVER = "too uncertain"
    OPEN = "no tolerance given"
    DOUBT = "not proven"
    MISSING = "not measured"

    @property
    def fails(self) -> bool:
        """Whether nothing can be decided with such a measurement."""
        return self in (Grade.MISSING, Grade.DOUBT, Grade.OVER)


@dataclass(frozen=True)
class Requirement:
    """One number that a drawing asks for, as a station measures it.

    Attributes
    ----------
    number : int
        Of its balloon, from 1.
    name, unit : str
    nominal : float
    tolerance : Tolerance or None
    sigma : float
        Standard deviation of one picture's value by noise; infinite where it cannot be measured.
    bias : float or None
        Mean error, measured where there is a run, else predicted; None where it is not known.
    u_bias : float or None
        Standard uncertainty of the bias; None where nothing is said of it.
    U : float or None
        Expanded uncertainty (95 %); None where it cannot be measured.
    status : str
    limits : str
        In words, the source with the largest share of the variance, and that share; empty where there is no budget.
    kind : str
        Of the measurand: distance, width, ...
    reason : str
        What decided a status that is not ``ok``, with its number; empty where no more is known than the status says.
    source : str
        The budget's name of the source in ``limits``; empty where there is no budget.
    """

    number: int
    name: str
    unit: str
    nominal: float
    tolerance: Tolerance | None
    sigma: float
    bias: float | None
    u_bias: float | None
    U: float | None
    status: str
    limits: str
    kind: str = "requirement"
    reason: str = ""
    source: str = ""

    @property
    def title(self) -> str:
        """The name as a page shows it: "bore, x" of ``bore.x``."""
        return cells.name(self.name)

    @property
    def ratio(self) -> float | None:
        """U over half of the tolerance zone; None without either, or where the value is not to be relied on."""
        if self.tolerance is None or self.U is None or not is_trusted(self.status):
            return None
        return self.U / self.tolerance.half

    @property
    def grade(self) -> Grade:
        if self.status not in MEASURED:
            return Grade.MISSING
        if not is_trusted(self.status):
            return Grade.DOUBT
        if self.tolerance is None:
            return Grade.OPEN
        if self.ratio is None or self.ratio > 1:
            return Grade.OVER
        return Grade.WELL if self.ratio <= WELL else Grade.WITHIN


def predicted(picture: Picture, p: float = 0.95) -> tuple[Requirement, ...]:
    """Of a picture, from its models alone: by the classic locators, as plans are made and runs are judged."""
    told = planner.predict(picture).measurands
    return requirements(
        picture,
        sigmas=[math.sqrt(each.variance_object) for each in told],
        biases=[finite(each.bias_object) for each in told],
        found=measurable_budget(picture, p=p, biased=True),
    )


def requirements(
    picture: Picture,
    sigmas: Sequence[float],
    biases: Sequence[float | None],
    found: SceneBudget | None,
    statuses: Sequence[str] | None = None,
    u_biases: Sequence[float | None] | None = None,
) -> tuple[Requirement, ...]:
    """One for each quantity of a picture's scene, in its order.

    Parameters
    ----------
    sigmas, biases, statuses, u_biases : sequences of M
        The scene's unit, or degrees. ``statuses`` are the predicted ones where not given.
    found : SceneBudget or None
        Of those that can be measured.
    """
    told, known = planner.predict(picture).measurands, {} if found is None else {each.name: each for each in found}
    statuses = [each.status for each in told] if statuses is None else statuses
    leading = {each.name: _leading(known.get(each.name)) for each in told}
    return tuple(
        Requirement(
            number=m + 1, name=each.name, unit=each.unit, nominal=each.nominal, tolerance=each.tolerance,
            sigma=sigmas[m], bias=biases[m], u_bias=u_biases[m] if u_biases else None,
            U=known[each.name].U if each.name in known and math.isfinite(sigmas[m]) else None,
            status=statuses[m], kind=each.kind,
            reason=each.why(statuses[m], u_biases[m] if u_biases else None, sigmas[m]),
            limits=_limits(leading[each.name]), source=leading[each.name][0],
        )
        for m, each in enumerate(told)
    )  # fmt: skip


def measurable_budget(
    picture: Picture,
    *,
    statuses: Sequence[str] | None = None,
    p: float = 0.95,
    biased: bool | None = None,
    **of_values: Sequence[float],
) -> SceneBudget | None:
    """The budget of those measurands that can be measured in a picture; None where there are none.

    ``statuses``, ``biased`` and, of the values, ``variances`` and ``biases`` of all M as of
    `planner.budgeting.budgets.budget`; ``doubts`` standard uncertainties of the biases where they are taken off.
    """
    scene, told = picture.scene, {name: np.array(values, float) for name, values in of_values.items()}
    good = np.isfinite([each.variance_object for each in planner.predict(picture).measurands])
    for name in told.keys() & {"variances", "biases"}:
        good &= np.isfinite(told[name])
    places = list(range(len(good)))
    if not good.all():
        names = [quantity.name for quantity in scene.quantities]
        own = [[names.index(quantity.name) for quantity in each.quantities] for each in scene.measurands]
        kept = [each for each, some in zip(scene.measurands, own, strict=True) if good[some].all()]
        if scene.task is not None or not kept:
            return None
        places = [m for some in own if good[some].all() for m in some]
        picture = picture.with_scene(scene.model_copy(update={"measurands": tuple(kept)}))
    known: dict[str, Any] = {name: values[places] for name, values in told.items()}
    if "doubts" in known:
        known["doubts"] = {source_words.ALL: known["doubts"]}
    try:
        states = statuses and tuple(statuses[m] for m in places)
        return budget(picture, **known, biased=biased, statuses=states, p=p)
    except InvalidInput:
        return None


def _leading(found: Budget | None) -> tuple[str, float]:
    """The source with the largest share of the variance, and that share; an empty name where there is none."""
    every = () if found is None else found.contributions
    worst = max(every, key=lambda row: round(row.share, 9), default=None)
    return ("", 0.0) if worst is None or not worst.share > 0 else (worst.source, worst.share)


def _limits(leading: tuple[str, float]) -> str:
    source, share = leading
    return f"{source_words.words(source)}, {100 * share:.0f} %" if source else ""
