"""Uncertainty budgets as bars."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from planner.uncertainty.budget import Budget
from validation.report.canvas import TEXT, WIDTH, save

_MOST = 12  # contributions of a measurand that are drawn


def draw(budgets: tuple[Budget, ...], path: Path) -> Path:
    """One panel a measurand: contributions (standard uncertainties in its unit), the largest on top, and u_c."""
    figure, panels = plt.subplots(
        len(budgets), 1, figsize=(WIDTH, 0.7 + sum(0.9 + 0.22 * _rows(b) for b in budgets)), squeeze=False,
        gridspec_kw={"height_ratios": [0.9 + 0.22 * _rows(b) for b in budgets]}, layout="constrained",
    )  # fmt: skip
    for panel, budget in zip(panels[:, 0], budgets, strict=True):
        rows = sorted(budget.contributions, key=lambda row: -abs(row.contribution))[:_MOST]
        names = [row.source for row in rows] + ["combined"]
        sizes = [abs(row.contribution) for row in rows] + [budget.u]
        panel.barh(names, sizes, color=["C0"] * len(rows) + ["C1"])
        panel.invert_yaxis()
        panel.set_title(f"{budget.name}: U = {budget.U:.2g} {budget.unit}, k = {budget.k:.3g}", fontsize=11, loc="left")
        panel.set_xlabel(f"standard uncertainty [{budget.unit}]", fontsize=TEXT)
        panel.tick_params(labelsize=TEXT)
        panel.locator_params(axis="x", nbins=4)
    return save(figure, path)


def _rows(budget: Budget) -> int:
    return min(len(budget.contributions), _MOST) + 1
