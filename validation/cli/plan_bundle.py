"""``ice plan --views --together``: several pictures that measure all measurands best, adjusted as one measurement."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NoReturn, cast

import typer

import scenes
from planner.views import MOST_VIEWS
from scenes.pose import one_or_all
from scenes.results import picked
from scenes.status import legend
from validation.cli.common import check_left_out, progress, say
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import planner
    from imaging.bundles.unknowns import Sensors
    from validation.cli.plan import Options

_NOT_TOGETHER = (
    "--search", "--edges", "--start", "--shares", "--tolerance", "--check", "--map", "--out", "--views-share", "--vary",
    "--hold", "--write", "--certify", "--place-board", "--coverage",
)  # fmt: skip


def check_options(context: typer.Context, views: int | None, together: str) -> None:
    """See that the options make sense together."""
    if views is None:
        raise scenes.InvalidInput(f"--views must be given with --together, got nothing beside {together!r}")
    if not 1 <= views <= MOST_VIEWS:
        raise scenes.InvalidInput(f"--views must be 1 to {MOST_VIEWS}, got {views}")
    if together not in ("known", "uncertain", "unknown"):
        raise scenes.InvalidInput(f"--together must be one of known, uncertain, unknown, got {together!r}")
    check_left_out(context, "--together", *_NOT_TOGETHER)


def run(scene: scenes.Scene, given: Options, how: dict) -> NoReturn:
    """Plan and show; the command ends with 1 where the most pictures leave a measurand open."""
    import planner

    if given.objective != "object":
        raise scenes.InvalidInput(f"objective must be object for several pictures, got {given.objective!r}")
    began, count = time.perf_counter(), given.views
    with progress(
        f"{scene.name}: searching 1 to {count} pictures that measure best adjusted together", "steps", at_once=True
    ) as shown:
        found = planner.plan_bundle(scene, cast("int", count), cast("Sensors", given.together), **how, report=shown)
    seconds = time.perf_counter() - began
    if given.as_json:
        say(facts(found, seconds), True, "")
    else:
        from validation.report import bundle_plan_table

        console().print(bundle_plan_table.report(found, seconds), highlight=False)
        for line in legend(found.sets[-1].prediction.status, found.sets[-1].prediction.reason):
            console().print(f"  {line}", highlight=False)
    raise typer.Exit(0 if found.sets[-1].is_plan else 1)


def facts(found: planner.BundlePlan, seconds: float) -> dict[str, Any]:
    """Everything for JSON; null is what is infinite or not known."""
    return plain({
        "scene": found.scene.name,
        "objective": "object",
        **picked(found, "over", "model", "sensors"),
        "views": [_set(each) for each in found.sets],
        **picked(found, "pairs", "looked", "guarantee"),
        "seconds": seconds,
    })  # fmt: skip


def _set(each: planner.BundleSet) -> dict[str, Any]:
    told = each.prediction
    return {
        "count": len(each.pictures),
        "poses": [
            {"sensor": list(one.sensor), "light": scenes.pairs(one_or_all(one.free_lights))} for one in each.pictures
        ],
        **picked(each, "is_plan", "minimised", "worst_ratio", "limiting"),
        "lost": list(each.lost),
        "hard": list(each.hard),
        **picked(each, "searched", "exhaustive", "bound", "gap", "impossible"),
        "measurands": [
            {name: row[name] for name in ("name", "kind", "unit", "sigma", "u_placed", "u")}
            | {"U": U, "ratio": ratio, "status": row["status"], "reason": reason}
            for row, U, ratio, reason in zip(told.as_rows(), each.U, each.ratios, told.reason, strict=True)
        ],
        "covariance": told.covariance,
    }
