"""Uncertainty budgets as one chart: a bar a requirement in per cent of its tolerance, stacked by source."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from planner.budgeting.budgets import SceneBudget
from planner.uncertainty.budget import Budget
from planner.uncertainty.improve import improvements
from scenes.status import is_trusted
from validation.report.canvas import TEXT, WIDTH, inline, plt, save
from validation.report.cells import name as shown_name
from validation.report.cells import percent
from validation.report.requirements import HALF
from validation.report.source_words import keyed

_SOURCES = 6  # that have a colour of their own; the others are one
_LONGEST = 26  # letters of a name
_LEAST_GAIN = 0.02  # part of U below which an improvement is not told
_LOOKS = (
    ("#0b3c5d", ""), ("#e69f00", "//"), ("#7fb2d9", ""), ("#8c1a11", "\\\\"), ("#5c9e6f", ""), ("#cc79a7", "xx"),
    ("#d9d9d9", ""),
)  # fmt: skip
_OTHERS = "all others"


def parts(budgets: Sequence[Budget], halves: Sequence[float | None]) -> tuple[list[str], np.ndarray]:
    """What each source makes of U: its share of the variance times U, so that a bar's parts add to U.

    Parameters
    ----------
    halves : sequence of M
        Half of each tolerance zone. Where one is not given, U itself is 100 %.

    Returns
    -------
    sources : list of S str
        Those with the largest parts, and ``all others``.
    parts : ndarray, shape (M, S)
        Per cent of half the tolerance zone.
    """
    every = {row.source: None for each in budgets for row in each.contributions}
    table = np.zeros((len(budgets), len(every)))
    names = list(every)
    for m, (each, half) in enumerate(zip(budgets, halves, strict=True)):
        whole = 100.0 if half is None else 100 * each.U / half
        for row in each.contributions:
            table[m, names.index(row.source)] = whole * max(row.share, 0.0)
    leading = sorted(range(len(names)), key=lambda s: (-round(float(table[:, s].max(initial=0)), 9), s))
    leading = [s for s in leading if table[:, s].max(initial=0) > 0]
    kept, rest = leading[:_SOURCES], leading[_SOURCES:]
    shown = np.concatenate([table[:, kept], table[:, rest].sum(1, keepdims=True)], 1) if rest else table[:, kept]
    return [names[s] for s in kept] + [_OTHERS] * bool(rest), shown


def improved(found: SceneBudget) -> list[str]:
    """What halving a source alone makes of U, a line a source, the most useful first."""
    gains: dict[str, dict[str, float]] = {}
    for each in found:
        for one in improvements(each):
            if one.gain >= _LEAST_GAIN:
                gains.setdefault(one.source, {})[each.name] = one.gain
    order = sorted(gains, key=lambda source: -round(max(gains[source].values()), 6))[:_SOURCES]
    half = "With half the uncertainty by"
    return [f"{half} {keyed(source)} U is smaller: of {_gained(gains[source])}." for source in order]


def _gained(gains: dict[str, float]) -> str:
    """The requirements that gain most, with what U becomes less by."""
    best = sorted(gains, key=lambda name: -round(gains[name], 6))
    shown = ", ".join(f"{shown_name(name)} by {100 * gains[name]:.0f} %" for name in best[:_SOURCES])
    return f"{shown}, and {len(best) - _SOURCES} more" if len(best) > _SOURCES else shown


def _drawn(found: SceneBudget):
    halves = [each.tolerance and each.tolerance.half for each in found.prediction.measurands]
    sources, table = parts(found.measurands, halves)
    count = len(found.measurands)
    figure, axis = plt.subplots(figsize=(WIDTH, 0.9 + 0.34 * count + 0.2 * (len(sources) + 1)), layout="constrained")
    left = np.zeros(count)
    for name, part, (colour, hatch) in zip(sources, table.T, _LOOKS, strict=False):
        axis.barh(range(count), part, left=left, height=0.62, color=colour, hatch=hatch, edgecolor="black", lw=0.5,
                  label=keyed(name))  # fmt: skip
        left += part
    for m, (each, state) in enumerate(zip(found, found.statuses, strict=True)):
        told = percent(left[m] / 100) if halves[m] is not None else f"U {each.U:.2g} {each.unit}"
        axis.annotate(
            told if is_trusted(state) else f"{told}, {state}", (left[m], m), (4, 0), textcoords="offset points",
            va="center", fontsize=TEXT,
        )  # fmt: skip
    _finished(axis, [shown_name(each.name) for each in found], left, any(half is not None for half in halves))
    return figure


def _finished(axis, names: list[str], ends: np.ndarray, toleranced: bool) -> None:
    """Names beside the bars; the limit, where it is not so far that no bar could be seen beside it."""
    most = float(ends.max(initial=0))
    far = toleranced and most < 20
    if toleranced and not far:
        axis.axvline(100, color="black", lw=1.4, ls="--", label=f"limit: U is as large as {HALF}")
    axis.set(ylim=(len(names) - 0.45, -0.55), xlim=(0, max(1.45 * most, 110 if toleranced and not far else 0, 1e-9)))
    axis.set_yticks(range(len(names)), [n if len(n) <= _LONGEST else n[: _LONGEST - 1] + "…" for n in names])
    axis.tick_params(labelsize=TEXT)
    what = f"U, % of {HALF}" if toleranced else "U, each 100 %: no tolerance is given"
    axis.set_xlabel(f"{what} (limit: 100 %)" if far else what, fontsize=TEXT)
    axis.figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=1, frameon=False,
                       fontsize=TEXT)  # fmt: skip


def draw(found: SceneBudget, path: Path) -> Path:
    """The chart as a file."""
    return save(_drawn(found), path)


def drawn(found: SceneBudget, key: str = "budget") -> Markup:
    """The chart as SVG within a page."""
    names = ", ".join(f"{shown_name(each.name)} {each.U:.2g} {each.unit}" for each in found)
    return inline(_drawn(found), key, f"Expanded uncertainties by source: {names}.")
