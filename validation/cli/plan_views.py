"""``ice plan --views``: several pictures that together measure all measurands best."""

from __future__ import annotations

import dataclasses
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import scenes
from planner.views import MOST_VIEWS
from scenes.results import picked
from validation.cli.common import check_left_out, progress, say
from validation.report.terminal import console
from validation.strict_json import plain

if TYPE_CHECKING:
    import planner
    from validation.cli.plan import Options
    from validation.views_check import ViewsCheck


def check_options(context: typer.Context, views: int | None, share: str | None) -> None:
    """See that the options make sense together."""
    if views is None:
        raise scenes.InvalidInput(f"--views must be given with --views-share, got nothing beside {share!r}")
    if not 1 <= views <= MOST_VIEWS:
        raise scenes.InvalidInput(f"--views must be 1 to {MOST_VIEWS}, got {views}")
    if share not in (None, "sensor", "light"):
        raise scenes.InvalidInput(f"--views-share must be one of sensor, light, got {share!r}")
    check_left_out(context, "--views", "--search", "--edges", "--start", "--tolerance", "--map")


def run(scene: scenes.Scene, given: Options, how: dict, *, checked: bool) -> None:
    """Plan, check by rendering, show; the command ends with 1 if the pictures contradict the plan."""
    import planner

    began, count = time.perf_counter(), given.views
    with progress(
        f"{scene.name}: searching 1 to {count} pictures that measure best together", "steps", at_once=True
    ) as shown:
        found = planner.plan_views(scene, count, given.objective, **how, share=given.views_share, report=shown)
    seconds = time.perf_counter() - began
    check = _check(found) if checked else None
    pictures = _pictures(found, given.out) if given.out else []
    if given.as_json:
        say(facts(found, check, pictures, seconds), True, "")
    else:
        from validation.report import views_table

        shown_on = console()
        shown_on.print(views_table.report(found, check, seconds), highlight=False)
        for path in pictures:
            shown_on.print(f"picture: {path}", highlight=False)
    if check and check.verdict and not check.verdict.agrees:
        raise typer.Exit(1)


def _check(found: planner.Views) -> ViewsCheck:
    from validation.views_check import check_views

    with progress(
        f"{found.scene.name}: rendering and measuring all pictures together", "pictures", at_once=True
    ) as shown:
        return check_views(found, report=shown)


def _pictures(found: planner.Views, out: Path) -> list[Path]:
    from validation.report import (
        views_figure,  # matplotlib takes half a second to load
        views_page,
    )

    return [*views_figure.draw(found, out), views_page.write(found, out / "plan.html")]


def facts(found: planner.Views, check: ViewsCheck | None, pictures: list[Path], seconds: float) -> dict:
    """Everything for JSON; null is what is infinite or not known."""
    return plain({
        "scene": found.scene.name,
        "objective": "object",
        **picked(found, "over", "model", "share"),
        **(picked(found, "vary", "hold") if found.vary else {}),
        "views": [_set(found, index) for index in range(len(found.sets))],
        **picked(found, "most_over_repeats", "pairs", "looked", "guarantee"),
        "check": None if check is None else _checked(check),
        "pictures": pictures,
        "seconds": seconds,
    })  # fmt: skip


def _set(found: planner.Views, index: int) -> dict:
    each = found.sets[index]
    both, first = each.combination, each.views[0].prediction.measurands
    return {
        "count": len(each.views),
        "poses": [_place(found, view) for view in each.views],
        **picked(each, "minimised", "worst_ratio", "limiting"),
        "lost": list(each.lost),
        "hard": list(each.hard),
        **picked(each, "over_one", "over_repeats", "exhaustive", "gap", "bound"),
        **({"over_own": found.over_own(index)} if found.vary else {}),
        "measurands": [_measurand(each, m) for m in range(len(first))],
        **picked(both, "covariance", "covariance_least_squares"),
    }


def _place(found: planner.Views, view: planner.View) -> dict:
    """Poses of a picture, and where it was varied what stands before lens and lamp."""
    told = {"sensor": list(view.sensor), "light": scenes.pairs(view.light)}
    if not found.vary:
        return told
    choice, longer = found.choice(view)
    return told | {"choice": dataclasses.asdict(choice), "exposure_time": longer}


def _measurand(each: planner.ViewSet, m: int) -> dict:
    both, alone = each.combination, [view.prediction.measurands[m] for view in each.views]
    return {
        **picked(alone[0], "name", "kind", "unit"),
        "sigma": math.sqrt(both.covariance[m, m]),
        "sigma_least_squares": math.sqrt(both.covariance_least_squares[m, m]),
        "bias": both.bias[m],
        "status": both.status[m],
        "pictures": [v + 1 for v in range(len(each.views)) if both.used[v, m]],
        "weights": both.weights[:, m].tolist(),
        "single": [{"sigma": math.sqrt(one.variance_object), "status": one.status} for one in alone],
    }


def _checked(check: ViewsCheck) -> dict:
    verdict = check.verdict
    return {
        "rows": check.rows,
        "agrees": None if verdict is None else verdict.agrees,
        "verdict": None if verdict is None else verdict.text,
        "reason": check.reason or None,
        "seconds": check.seconds,
    }
