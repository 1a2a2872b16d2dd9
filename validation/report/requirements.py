"""The requirements of a drawing at one station: how well each is measured against its tolerance, and why not better."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

import planner
from planner.budgeting.budgets import SceneBudget, budget
from planner.uncertainty.budget import Budget
from scenes import InvalidInput, Picture, Tolerance
from scenes.results import finite
from scenes.status import MEANINGS, REMEDIES, WORST_FIRST, is_trusted

_WELL = 0.25  # of half the tolerance: a test uncertainty ratio of 4 to 1 (ANSI/NCSL Z540.3)
_UNSURE = "what is not exactly known"  # of a bias that is taken off
_NAMED = 4  # requirements that a sentence names


class Grade(StrEnum):
    """What the expanded uncertainty is against half of the tolerance zone."""

    WELL = "well within tolerance"
    WITHIN = "within tolerance"
    OVER = "too uncertain"
    OPEN = "no tolerance given"
    DOUBT = "not proven"


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
        The source with the largest share of the variance, and that share; empty where there is no budget.
    kind : str
        Of the measurand: distance, width, ...
    reason : str
        What decided a status that is not ``ok``, with its number; empty where no more is known than the status says.
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

    @property
    def ratio(self) -> float | None:
        """U over half of the tolerance zone; None without either, or where the value is not to be relied on."""
        if self.tolerance is None or self.U is None or not is_trusted(self.status):
            return None
        return self.U / self.tolerance.half

    @property
    def grade(self) -> Grade:
        if not is_trusted(self.status):
            return Grade.DOUBT
        if self.tolerance is None:
            return Grade.OPEN
        if self.ratio is None or self.ratio > 1:
            return Grade.OVER
        return Grade.WELL if self.ratio <= _WELL else Grade.WITHIN


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
    return tuple(
        Requirement(
            number=m + 1, name=each.name, unit=each.unit, nominal=each.nominal, tolerance=each.tolerance,
            sigma=sigmas[m], bias=biases[m], u_bias=u_biases[m] if u_biases else None,
            U=known[each.name].U if each.name in known and math.isfinite(sigmas[m]) else None,
            status=statuses[m], kind=each.kind,
            reason=each.why(statuses[m], u_biases[m] if u_biases else None, sigmas[m]),
            limits=_limits(known[each.name]) if each.name in known else "",
        )
        for m, each in enumerate(told)
    )  # fmt: skip


def measurable_budget(
    picture: Picture,
    variances: Sequence[float] | None = None,
    biases: Sequence[float] | None = None,
    statuses: Sequence[str] | None = None,
    doubts: Sequence[float] | None = None,
    p: float = 0.95,
    biased: bool | None = None,
) -> SceneBudget | None:
    """The budget of those measurands that can be measured in a picture; None where there are none.

    ``variances``, ``biases``, ``statuses`` and ``biased`` of all M as of `planner.budgeting.budgets.budget`; ``doubts``
    standard uncertainties of the biases where they are taken off.
    """
    forecasts, scene = planner.predict(picture).measurands, picture.scene
    good = [math.isfinite(each.variance_object) for each in forecasts]
    for given in (variances, biases):
        good = [fine and (given is None or math.isfinite(given[m])) for m, fine in enumerate(good)]
    if not all(good):
        kept, places = [], []
        for each in scene.measurands:
            own = [[q.name for q in scene.quantities].index(quantity.name) for quantity in each.quantities]
            if all(good[m] for m in own):
                kept.append(each)
                places += own
        if scene.task is not None or not kept:
            return None
        picture = picture.with_scene(scene.model_copy(update={"measurands": tuple(kept)}))
    else:
        places = list(range(len(good)))
    told = {"variances": variances, "biases": biases, "doubts": doubts}
    known = {name: np.array([each[m] for m in places], float) for name, each in told.items() if each is not None}
    known["biased"] = biased
    if doubts is not None:
        known["doubts"] = {_UNSURE: known["doubts"]}
    try:
        return budget(picture, **known, statuses=statuses and tuple(statuses[m] for m in places), p=p)
    except InvalidInput:
        return None


def _limits(found: Budget) -> str:
    worst = max(found.contributions, key=lambda row: round(row.share, 9), default=None)
    return "" if worst is None or not worst.share > 0 else f"{worst.source}, {100 * worst.share:.0f} %"


def what(found: Sequence[Requirement]) -> str:
    """What is measured, in plain words.

    >>> what([])
    'Nothing'
    """
    kinds = Counter(each.kind for each in found)
    parts = [f"{count} {kind}{'s' * (count > 1)}" for kind, count in kinds.items()]
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else "".join(parts) or "Nothing"


def sentence(found: Sequence[Requirement]) -> str:
    """How well all of them are measured, in plain words."""
    grades = [each.grade for each in found]
    parts = []
    if good := grades.count(Grade.WELL):
        parts.append(
            f"{_count(good, len(found))} measured well within tolerance: the expanded uncertainty U (95 %) is at most "
            f"{100 * _WELL:.0f} % of it"
        )
    for grade, words in (
        (Grade.WITHIN, f"measured within tolerance, with an uncertainty U above {100 * _WELL:.0f} % of it"),
        (Grade.OVER, "measured with an uncertainty U that is larger than the tolerance"),
        (Grade.OPEN, f"measured{_known(found)}; no tolerance is given to compare with"),
        (Grade.DOUBT, "not proven: its value must not be relied on"),
    ):
        if some := [each for each in found if each.grade == grade]:
            words = words if len(some) == 1 else words.replace("its value", "their values")
            parts.append(f"{_which(some, len(found))} {words}")
    return ". ".join(part[0].upper() + part[1:] for part in parts) + "."


def _known(found: Sequence[Requirement]) -> str:
    """The uncertainty of what has no tolerance, where that is one number."""
    each = [one for one in found if one.grade == Grade.OPEN]
    if len(each) != 1 or each[0].U is None:
        return ""
    return f" with an expanded uncertainty U (95 %) of {each[0].U:.2g} {each[0].unit}"


def wrong(found: Sequence[Requirement]) -> list[str]:
    """What is wrong, a line for each status that is not ``ok`` and each U that is too large; empty where nothing is."""
    lines = []
    for status in WORST_FIRST:
        some = [each for each in found if each.status == status and not is_trusted(status)]
        if some:
            told = next((each for each in some if each.reason), None)
            about = f"{f'of {told.name}, ' if len(some) > 1 else ''}{told.reason}" if told else MEANINGS[status]
            lines.append(f"{_joined([each.name for each in some])} ({status}): {about}.")
    for each in found:
        if each.grade == Grade.OVER and each.ratio is not None:
            lines.append(f"{each.name}: U is {each.ratio:.2g} times what the tolerance allows{_mostly(each)}.")
    return [line[0].upper() + line[1:] for line in lines]


def _count(some: int, every: int) -> str:
    if every == 1:
        return "The requirement is"
    return f"all {every} requirements are" if some == every else f"{some} of {every} requirements {_are(some)}"


def _are(count: int) -> str:
    return "is" if count == 1 else "are"


def _which(some: Sequence[Requirement], every: int) -> str:
    """By name where they are few."""
    if len(some) > _NAMED or len(some) == every:
        return _count(len(some), every) if every > 1 else f"{some[0].name} is"
    return f"{_joined([each.name for each in some])} {_are(len(some))}"


def _joined(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _numbers(numbers: Sequence[int]) -> str:
    return f"Requirement{'s' * (len(numbers) > 1)} {_joined([str(each) for each in numbers])}"


def _mostly(each: Requirement) -> str:
    return f"; most of it comes from {each.limits.rsplit(',', 1)[0]}" if each.limits else ""


def next_step(found: Sequence[Requirement]) -> str:
    """What to do about what is wrong, the worst first; then about the largest uncertainty."""
    doubtful = [status for status in WORST_FIRST if any(r.status == status for r in found) and not is_trusted(status)]
    if doubtful:
        steps = [(_numbers([each.number for each in found if each.status == s]), REMEDIES[s]) for s in doubtful]
        return " ".join(f"{numbers}: {remedy}." for numbers, remedy in steps)
    over = [each for each in found if each.grade in (Grade.OVER, Grade.WITHIN)]
    if over:
        worst = max(over, key=lambda each: (round(each.ratio or math.inf, 9), -each.number))
        return f"Improve {worst.name} first{_mostly(worst)}."
    if found and all(each.grade == Grade.OPEN for each in found):
        return "Give each requirement its tolerance in the scene, then U can be compared with it."
    return "Nothing has to be changed: set camera and lamp up at these places."
