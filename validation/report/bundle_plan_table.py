"""What ``ice plan --views --together`` prints."""

from __future__ import annotations

from rich.console import Group
from rich.table import Table
from rich.text import Text

import planner
from validation.report.cells import number as _number
from validation.report.cells import pose as _pose
from validation.report.cells import table as _table

_SENSORS = {
    "known": "sensors count as known",
    "uncertain": "sensors known to what the scene says",
    "unknown": "nothing known of where sensors stand",
}
_TERMS = """\
  minimised: what is said above, of all pictures adjusted together. over bound: how far above what no pictures of the
  grid can stay below, by a glance. over exhaustive: above the best of all sets of what was looked at closely. Both are
  told edge by edge, as the search has it; all else as the estimator that is taken has it."""


def report(found: planner.BundlePlan, seconds: float) -> Group:
    """Numbers of pictures, their poses, and what each measurand's uncertainty is with each."""
    parts = [Text(_head(found)), _numbers(found), Text(_TERMS), _poses(found), _quantities(found), *_open(found)]
    hard = [f"{', '.join(each.hard)} of {len(each.pictures)}" for each in found.sets if each.hard]
    if hard:
        parts.append(
            Text(f"  Hard to set up: a little off the poses these are not told, or far worse: {'; '.join(hard)}.")
        )
    return Group(*parts, Text(
        f"  {found.pairs} pairs glanced at, {found.looked} settings looked at closely, in {seconds:.1f} s\n"
        f"  Guarantee: {found.guarantee}."
    ))  # fmt: skip


def _head(found: planner.BundlePlan) -> str:
    several = "worst ratio of u to tolerance, squared" if found.over == "minimax" else "sum of ratios^2"
    least = "variance" if len(found.scene.quantities) == 1 else several
    return (
        f"{found.scene.title or found.scene.name}\n"
        f"Pictures that measure best adjusted together: least {least} ({found.model} model), {_SENSORS[found.sensors]}"
    )


def _numbers(found: planner.BundlePlan) -> Table:
    columns = "pictures", "told", "minimised", "worst ratio", "limited by", "over bound", "over exhaustive"
    table, whole = _table("", *columns), len(found.scene.quantities)
    for each in found.sets:
        near = each.searched / each.exhaustive - 1 if each.exhaustive and each.searched else None
        told = f"{whole - len(each.lost)} of {whole}"
        if each.is_plan:
            table.add_row(
                str(len(each.pictures)), told, _number(each.minimised, ".4g"), _number(each.worst_ratio),
                each.limiting or "-", _percent(each.gap), _percent(near),
            )  # fmt: skip
        else:
            table.add_row(str(len(each.pictures)), told, "no plan", "-", "-", "-", "-")
    return table


def _percent(part: float | None) -> str:
    return "-" if part is None else f"{100 * part:.1f} %"


def _poses(found: planner.BundlePlan) -> Table:
    table = _table("\nWhere they are taken", "pictures", "", "sensor", "light")
    for each in filter(lambda each: each.is_plan, found.sets):
        for number, picture in enumerate(each.pictures, 1):
            first = str(len(each.pictures)) if number == 1 else ""
            table.add_row(first, f"no. {number}", _pose(picture.sensor), _pose(picture.free_lights))
    return table


def _quantities(found: planner.BundlePlan) -> Table:
    """Of each measurand its expanded uncertainty for each number of pictures, and of the most what it is made of."""
    last = found.sets[-1]
    table = _table("\nEach measurand: U (95 %), and of the most pictures sigma by noise, u by all that is adjusted",
                   "name", "unit", *(f"U of {len(each.pictures)}" for each in found.sets), "sigma", "u",
                   "u / tolerance", "status")  # fmt: skip
    for m, row in enumerate(last.prediction.as_rows()):
        each = (_number(one.U[m]) for one in found.sets)
        table.add_row(
            row["name"], row["unit"], *each, _number(row["sigma"]), _number(row["u"]), _number(last.ratios[m]),
            row["status"],
        )  # fmt: skip
    return table


def _open(found: planner.BundlePlan) -> list[Text]:
    """What numbers of pictures that are no plan leave open, and whether any of the grid's tell it."""
    lines = []
    for each in found.sets:
        if each.is_plan:
            continue
        m = next(i for i, q in enumerate(each.prediction.quantities) if q.name in each.lost)
        why = each.prediction.reason[m]
        sure = "no others of the grid tell all" if each.impossible else "none that were found tell all"
        count = "One picture does" if len(each.pictures) == 1 else f"{len(each.pictures)} pictures do"
        lines.append(Text(f"  {count} not tell {', '.join(each.lost)} ({sure}): {why}."))
    return lines
