"""Uncertainty budgets in a run's report: of every scene that says what is not exactly known, at its first setting."""

from __future__ import annotations

import math
from collections.abc import Iterator

from planner.budgeting.budgets import SceneBudget, budget
from planner.uncertainty.budget import Budget
from scenes import InvalidInput, Picture, Scene, Uncertainty
from validation.report.budget_table import sentence, summary


def budgets_of(scenes: tuple[Scene, ...]) -> Iterator[SceneBudget]:
    """Budgets of the scenes that have uncertainties and a setting at which all can be measured."""
    for scene in scenes:
        if scene.settings and (scene.uncertain or scene.uncertainty != Uncertainty()):
            try:
                yield budget(Picture.of(scene, scene.settings[0].sensor, scene.settings[0].lights))
            except InvalidInput:
                continue


def cells(each: Budget) -> list[list[str]]:
    """One row of text a contribution, the largest first."""
    rows = sorted(each.contributions, key=lambda row: -row.share)
    return [
        [
            row.source, f"{row.u:.3g}", f"{row.sensitivity:.3g}", f"{row.contribution:.3g}", f"{100 * row.share:.1f} %",
            row.type, "" if math.isinf(row.dof) else f"{row.dof:.0f}",
        ]
        for row in rows
    ]  # fmt: skip


def note(found: SceneBudget, m: int) -> str:
    """Sum and sentence."""
    each, quantity = found.measurands[m], found.picture.scene.quantities[m]
    return f"{summary(each)}. {sentence(each, quantity.kind, found.statuses[m])}."
