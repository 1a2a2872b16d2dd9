"""``ice plan --objective capability``: the poses of the smallest expanded uncertainty against the tolerance."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import scenes
from scenes.results import picked
from scenes.status import is_trusted
from validation.cli.common import progress, say
from validation.report.terminal import console

if TYPE_CHECKING:
    from planner.budgeting.plans import CapabilityPlan, Placed


def run(scene: scenes.Scene, how: dict, as_json: bool) -> None:
    """Plan and show."""
    from planner.budgeting.plans import STEP_DEG, plan_capability

    began = time.perf_counter()
    step = how.pop("step_deg") or STEP_DEG
    with progress(f"{scene.name}: searching the pose that a tolerance wants", "steps", at_once=True) as shown:
        found = plan_capability(scene, step_deg=step, **how, report=shown)
    seconds = time.perf_counter() - began
    if as_json:
        say(facts(scene, found, step, seconds), True, "")
        return
    from validation.report.cells import number, pose, table

    title = f"{scene.title or scene.name}: poses of the smallest worst U / T"
    columns = ("planned for", "sensor", "light", "measurand", "u by noise", "u_c", "U", "U / T", "status")
    rows = [
        (words, pose(placed.sensor), pose(placed.light), row["name"],
         *(f"{row[key]:.3g}" for key in ("repeatability", "u", "U")), number(row["ratio"], ".3f"), row["status"])
        for words, placed in (("U / T", found.best), ("noise alone", found.quiet))
        for row in _rows(placed)
    ]  # fmt: skip
    shown_on = console()
    shown_on.print(table(title, *columns, rows=rows, words=columns))
    shown_on.print(f"T: half of the tolerance zone. {_guarantee(found, step)}. {seconds:.1f} s.", highlight=False)


def facts(scene: scenes.Scene, found: CapabilityPlan, step: float, seconds: float) -> dict:
    """Everything for JSON."""
    return {
        "scene": scene.name,
        "objective": "capability",
        **_placed(found.best),
        "noise_alone": _placed(found.quiet),
        "pairs": found.pairs,
        "guarantee": _guarantee(found, step),
        "seconds": seconds,
    }


def _guarantee(found: CapabilityPlan, step: float) -> str:
    return f"No pair of the {step:g} degree grid ({found.pairs} pairs) is better by noise and places in the image"


def _placed(placed: Placed) -> dict:
    return {
        "sensor": list(placed.sensor),
        "light": scenes.pairs(placed.light),
        "worst_ratio": max(placed.ratios, default=None) if all(map(is_trusted, placed.budget.statuses)) else None,
        "measurands": _rows(placed),
    }


def _rows(placed: Placed) -> list[dict]:
    found = placed.budget
    rows = zip(found.measurands, found.prediction.measurands, found.statuses, strict=True)
    return [
        {
            **picked(each, "name", "unit", "repeatability", "u", "U", "k"),
            "ratio": each.U / told.tolerance.half if told.tolerance is not None and is_trusted(status) else None,
            "status": status,
        }
        for each, told, status in rows
    ]
