"""What ``ice plan --coverage`` prints: from where each measurand can be measured, and the fewest pictures for all."""

from __future__ import annotations

import math

from rich.console import Group
from rich.table import Table
from rich.text import Text

import planner
from scenes.results import finite
from scenes.status import legend
from validation.report import cells

_TERMS = (
    " places: part of all pairs of camera and light on the grid from which it can be measured, by a glance. picture: in"
    " which it is most precise; sigma there, and over half of its tolerance zone, looked at closely."
)


def report(found: planner.Coverage, seconds: float) -> Group:
    """The sentence, the pictures, the measurands, and what no picture measures, with the reason."""
    doubtful = [each for each in found.places if each.picture is not None]
    reasons = [f"{each.name}: {each.reason}" if each.reason else "" for each in doubtful]
    lines = [f" {line}" for line in legend([each.status for each in doubtful], reasons)]
    lost = [f" {each.name}: {each.status}{f' ({each.reason})' if each.reason else ''}" for each in found.lost]
    parts = [Text(f"{found.scene.title or found.scene.name}\n"), Text(sentence(found), style="bold")]
    if found.shots:
        parts += [_shots(found), _places(found), Text("\n".join([_TERMS, *lines]))]
    if some := [each.name for each in found.places if each.picture is not None and not each.is_usable]:
        parts.append(Text(f"\nToo uncertain (U over half of the tolerance zone): {', '.join(some)}.", style="bold"))
    if lost:
        parts += [Text("\nNo picture of the grid measures:", style="bold"), Text("\n".join(lost))]
    return Group(*parts, Text(f"\n {found.pairs} pairs of the {found.step_deg:g} degree grid in {seconds:.1f} s"))


def sentence(found: planner.Coverage) -> str:
    """How many pictures do, whether fewer could, and what to do next."""
    whole, count = len(found.places) - len(found.lost), len(found.shots)
    some = f"{whole} of {len(found.places)} measurands" if found.lost else f"all {whole} measurands"
    if count == 0:
        return "No picture of the grid measures anything."
    if count == 1:
        said = f"One picture measures {some}"
        then = "finds where it is most precise"
    else:
        one = f"no {count - 1} of the grid do" if count > 2 else "no one picture of the grid does"
        said = (
            f"{count} pictures measure {some}; {one if found.bound == count else f'{found.bound} might, by a glance'}"
        )
        then = "finds where they are most precise together"
    views = f" --views {count}" * (count > 1)
    first = "Without the others, " if found.lost else ""
    return f"{said}. {first}`ice plan SCENE{views}` {then}."


def _shots(found: planner.Coverage) -> Table:
    table = cells.table("\nThe pictures", "picture", "sensor", "light", "measures", words=("measures",), wrap=True)
    for number, shot in enumerate(found.shots, 1):
        names = ", ".join(shot.measures)
        table.add_row(str(number), cells.pose(shot.sensor), cells.pose(shot.light), names)
    return table


def _places(found: planner.Coverage) -> Table:
    columns = ("measurand", "kind", "places", "picture", "sigma", "sigma / tolerance", "status")
    table = cells.table("\nThe measurands", *columns, words=("measurand", "kind", "status"))
    for m, each in enumerate(found.places):
        if each.picture is None:
            table.add_row(each.name, each.kind, cells.percent(each.part), "-", "-", "-", each.status)
            continue
        told = found.shots[each.picture - 1].prediction.measurands[m]
        sigma = cells.united(cells.sigma(told.variance_object), told.unit)
        table.add_row(each.name, each.kind, cells.percent(each.part), str(each.picture), sigma,
                      cells.number(told.ratio), each.status)  # fmt: skip
    return table


def facts(found: planner.Coverage, seconds: float) -> dict:
    """The document of ``ice plan --coverage --json``; null is what is not known."""
    measurands = []
    for m, each in enumerate(found.places):
        told = None if each.picture is None else found.shots[each.picture - 1].prediction.measurands[m]
        measurands.append({
            "name": each.name, "kind": each.kind, "places": each.part, "usable": each.is_usable,
            "picture": each.picture,
            "unit": found.scene.unit_of(found.scene.quantities[m]),
            "sigma": told and finite(math.sqrt(told.variance_object)), "ratio": told and finite(told.ratio),
            "status": each.status, "reason": each.reason,
        })  # fmt: skip
    pictures = [
        {"sensor": list(shot.sensor), "light": _light(shot.light), "measures": list(shot.measures)}
        for shot in found.shots
    ]
    return {
        "scene": found.scene.name,
        "coverage": {
            "pictures": pictures, "measurands": measurands, "lost": [each.name for each in found.lost],
            "bound": found.bound, "step": found.step_deg, "pairs": found.pairs,
        },
        "seconds": seconds,
    }  # fmt: skip


def _light(light) -> list:
    """Of the one free light its pose; of none nothing."""
    return list(map(float, light)) if light else []
