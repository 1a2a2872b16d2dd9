"""The tables of an uncertainty budget in a page."""

from __future__ import annotations

import math

from planner.budgeting.budgets import SceneBudget
from planner.uncertainty.budget import Budget
from validation.report.budget_table import signed, summary


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
    return f"{summary(found.measurands[m])}. {signed(found, m)}."
