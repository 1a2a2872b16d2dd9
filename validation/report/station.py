"""One station: a picture, the requirements as it measures them, and the budget behind their uncertainties."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import planner
from planner.budgeting.budgets import SceneBudget
from scenes import Picture
from scenes.status import is_trusted
from validation import budgets
from validation.batch.campaign import Campaign
from validation.batch.measurands import column
from validation.batch.result import Validation
from validation.batch.rows import Row
from validation.batch.store import RunFile
from validation.report.requirements import Requirement, finite, measurable_budget, predicted, requirements


@dataclass(frozen=True, eq=False)
class Station:
    """What the first screen of a page shows.

    ``image`` is a noise-free render or a photograph, grey levels (height, width), None where there is none; ``number``
    that of the setting in its run, from 1, None outside of a run.
    """

    picture: Picture
    requirements: tuple[Requirement, ...]
    budget: SceneBudget | None
    image: np.ndarray | None = None
    number: int | None = None


def of_picture(picture: Picture, p: float = 0.95, *, simulated: bool = False) -> Station:
    """As the models predict it; ``simulated``: where formulas do not tell all, with biases that renders tell, taken
    off."""
    told = planner.predict(picture).measurands
    if not simulated or budgets.formulas_do(picture, tuple(each.status for each in told)):
        return Station(picture, predicted(picture, p), measurable_budget(picture, p=p, biased=True))
    off = budgets.simulated(picture)
    known = measurable_budget(picture, variances=off.sigma**2, statuses=off.status, doubts=off.u_bias, p=p)
    made = requirements(
        picture,
        sigmas=off.sigma.tolist(),
        biases=[0.0 if math.isfinite(bias) else None for bias in off.bias],
        found=known,
        statuses=off.status,
        u_biases=[finite(u) for u in off.u_bias],
    )
    return Station(picture, made, known)


def of_budget(found: SceneBudget) -> Station:
    """Of a budget that is known, with its statuses and its noise."""
    told = found.prediction.measurands
    made = requirements(
        found.picture,
        sigmas=[each.repeatability for each in found],
        biases=[finite(each.bias_object) if found.unsure is None else 0.0 for each in told],
        found=found,
        statuses=found.statuses,
        u_biases=found.u_bias,
    )
    return Station(found.picture, made, found)


def of_run(campaign: Campaign, found: Validation, store: RunFile) -> Station:
    """The best setting of a run, with what was measured there."""
    row = best(found, halves_of(campaign))
    picture, rows = campaign.case(row.index).picture, row.measurands
    statuses, about = [each.status for each in rows], {}
    if any(each.u_bias is not None for each in rows):
        about = {"doubts": [math.inf if each.u_bias is None else each.u_bias for each in rows]}
    elif not store.identity().get("photos"):
        about = {"biases": _biases(row, store)}
    known = measurable_budget(picture, variances=[each.predicted for each in rows], statuses=statuses, **about)
    made = requirements(
        picture,
        sigmas=[math.sqrt(each.predicted) for each in rows],
        biases=[each.bias for each in rows],
        found=known,
        statuses=statuses,
        u_biases=[each.u_bias for each in rows],
    )
    image = store.image(row.index) if store.has_image(row.index) else None
    return Station(picture, made, known, image, row.index + 1)


def _biases(row: Row, store: RunFile) -> list[float]:
    """Of each measurand in the noise-free image."""
    values = (store.propagated(row.index, column(row.main.method, k))[1] for k in range(len(row.measurands)))
    return [value - each.value for value, each in zip(values, row.measurands, strict=True)]


def reasons(campaign: Campaign, rows: Sequence[Row]) -> dict[str, str]:
    """By status that is not trusted what decided it at the first requirement of some rows that has it, with its number;
    empty where no more is known than the status says."""
    told: dict[str, str] = {}
    for row in rows:
        doubtful = [m for m, each in enumerate(row.measurands) if not is_trusted(each.status)]
        if all(row.measurands[m].status in told for m in doubtful):
            continue
        forecasts = planner.predict(campaign.case(row.index).picture).measurands
        for m in doubtful:
            each = row.measurands[m]
            why = forecasts[m].why(each.status, each.u_bias, math.sqrt(each.predicted))
            told.setdefault(each.status, why and f"{each.name}, setting {row.index + 1}: {why}")
    return told


def halves_of(campaign: Campaign) -> dict[str, float]:
    """Half of each tolerance zone by name of the requirement, of those that have one."""
    every = (quantity for scene in campaign.scenes for quantity in scene.quantities)
    return {quantity.name: quantity.tolerance.half for quantity in every if quantity.tolerance}


def best(found: Validation, halves: dict[str, float]) -> Row:
    """The setting at which most requirements are proven, and of several such that with the least uncertainty.

    That is the largest sigma against its tolerance, or, of scenes without tolerances, the product of all sigmas.
    """
    return min(found.rows, key=lambda row: (*merit(row, halves), row.index))


def merit(row: Row, halves: dict[str, float]) -> tuple[int, float]:
    """What `best` makes least: how many are not proven, and the uncertainty, rounded to what all machines agree on."""
    doubtful = sum(not is_trusted(each.status) for each in row.measurands)
    size = worst(row, halves)
    if size is None:
        logs = [math.log(each.predicted) for each in row.measurands if 0 < each.predicted < math.inf]
        size = sum(logs) / len(logs) if logs else math.inf
    return doubtful, float(f"{size:.5g}")


def worst(row: Row, halves: dict[str, float]) -> float | None:
    """The largest sigma of a setting over half its tolerance zone; None without tolerances."""
    known = [math.sqrt(each.predicted) / halves[each.name] for each in row.measurands if each.name in halves]
    return max(known, default=None)
