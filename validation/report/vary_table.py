"""What ``ice plan --vary`` prints and writes beside the plan."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

from planner import Chosen, Plan, Varied, View, Views
from planner.design import Choice
from scenes.results import picked
from validation.report.cells import pose as _pose
from validation.report.cells import table as _table
from validation.strict_json import plain

if TYPE_CHECKING:
    from validation.vary_check import VaryCheck

HELD = {
    "time": "exposure time: a polariser before the lamp and one before the lens each pass half of unpolarised light,"
    " lamps bring their power, filters what they pass",
    "white": "the grey level of a white diffuse surface: what polarisers, lamps and filters take is made up for by"
    " exposure time",
}


CHOICE = ("analyser", "polarisation", "band", "time")
"""Columns of `of_choice`."""
OF_CHOICE = (
    "analyser, polarisation: angles of the polarisers before lens and lamp, degrees; band: lamp and filter. time: of"
    " exposure, 1 is that of the scene."
)
COLUMNS = ("", "sensor", "light", *CHOICE, "minimised", "status")
TERMS = f"  {OF_CHOICE}\n  minimised: variance. fixed: the scene's own choice, at the best poses for it."


def report(found: Plan, checked: VaryCheck | None, seconds: float) -> Group:
    """Choices, gain, and what noisy pictures of both plans say."""
    varied = found.varied
    lines = [
        f"\nProposed, with what was varied: {proposed(varied)}.",
        f"  Varied: {', '.join(varied.vary)} ({varied.evaluated} settings in {seconds:.1f} s with the plan)",
        f"  Equal: {HELD[varied.hold]}.",
        f"  Gain over the fixed choice: {varied.gain:.3f} in variance with poses of their own,"
        f" {varied.gain_same_poses:.3f} at its poses.",
        f"  Guarantee: {varied.guarantee}.",
    ]
    table = _table("\nFixed and best choice", *COLUMNS, rows=choices(varied))
    parts = [Text("\n".join(lines)), table, Text(TERMS)]
    if checked:
        parts += [_scatters(checked), Text(_judgement(checked))]
    return Group(*parts)


def choices(varied: Varied) -> list[list[str]]:
    """Cells of the fixed choice, of the best at its poses, and of the best, as `COLUMNS`."""
    names = ("fixed", "best at its poses", "best")
    return [_chosen(*each) for each in zip(names, (varied.fixed, varied.same_poses, varied.best), strict=True)]


def _chosen(name: str, chosen: Chosen) -> list[str]:
    before = name, _pose(chosen.sensor), _pose(chosen.light)
    return [*before, *of_choice(chosen.choice, chosen.exposure_time), f"{chosen.variance:.4g}", chosen.status]


def of_choice(choice: Choice, time: float) -> list[str]:
    """Cells of what stands before lens and lamp: analyser, polarisation, band, and time of exposure."""
    return [angle(choice.analyser_deg), angle(choice.polarisation_deg), choice.band, f"{time:.3g}"]


def proposed(varied: Varied) -> str:
    """The best choice and its poses, and what it gains, in words."""
    best, choice = varied.best, varied.best.choice
    angles = (("analyser at", choice.analyser_deg), ("polariser before the lamp at", choice.polarisation_deg))
    parts = [choice.band, *(f"{what} {angle:.1f} degrees" for what, angle in angles if angle is not None)]
    return (
        f"{', '.join(parts)}; sensor {_pose(best.sensor)}, light {_pose(best.light)}. The scene's own choice has "
        f"{varied.gain:.2f} times the variance at its best places"
    )


def _scatters(checked: VaryCheck) -> Table:
    title = f"\nBoth plans in {checked.fixed.n} noisy pictures each: variance, with its 95 % chi-square interval"
    columns = ("", "measurand", "predicted", "propagated", "measured", "interval", "failed", "status")
    table = _table(title, *columns)
    for name, row in (("fixed", checked.fixed), ("best", checked.best)):
        values = (f"{value:.4g}" for value in (row.predicted, row.propagated, row.measured))
        interval = f"[{row.interval[0]:.4g}, {row.interval[1]:.4g}]"
        table.add_row(name, row.measurand, *values, interval, str(row.failed), row.status)
    return table


def _judgement(checked: VaryCheck) -> str:
    low, high = checked.interval
    return (
        f"  Gain: predicted {checked.predicted_gain:.3f}, measured {checked.gain:.3f} with the 95 % F interval"
        f" [{low:.3f}, {high:.3f}].\n  {checked.verdict}"
    )


_SCATTER = ("measurand", "predicted", "propagated", "measured", "interval", "n", "failed", "status")


def facts(varied: Varied | None, checked: VaryCheck | None) -> dict | None:
    """For JSON; None without."""
    if varied is None:
        return None
    return plain({
        **picked(varied, "vary", "hold", "gain", "gain_same_poses"),
        **{name: _fact(getattr(varied, name)) for name in ("fixed", "same_poses", "best")},
        **picked(varied, "evaluated", "guarantee"),
        "check": None if checked is None else _check(checked),
    })  # fmt: skip


def _fact(chosen: Chosen) -> dict:
    return {
        **dataclasses.asdict(chosen.choice),
        "band": chosen.choice.band,
        "sensor": list(chosen.sensor),
        "light": list(chosen.light),
        **picked(chosen, "variance", "status", "exposure_time"),
    }


def _check(checked: VaryCheck) -> dict:
    return {
        "fixed": picked(checked.fixed, *_SCATTER),
        "best": picked(checked.best, *_SCATTER),
        **picked(checked, "predicted_gain", "gain"),
        "gain_interval": checked.interval,
        **picked(checked, "p_value", "verdict"),
    }


def of_view(found: Views, view: View) -> list[str]:
    """The same of one of several pictures."""
    return of_choice(*found.choice(view))


def angle(value: float | None) -> str:
    """Of a polariser, for a cell."""
    return "none" if value is None else f"{value:.1f}"
