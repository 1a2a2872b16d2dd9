"""``ice effects``: which effects a scene calls for, and whether that is true."""

from __future__ import annotations

import math
from typing import Annotated

import typer
from rich.table import Table

import scenes
from render.phenomena import Decision, Effect, Tolerance, effects
from validation.cli.common import AUTO, Effects, Json, LeaveOutPx, LeaveOutVariance, SceneName, app, progress, say
from validation.effects_check import RENDERED, Switched, check
from validation.report.table import console


@app.command("effects")
def effects_command(
    scene: SceneName,
    check_them: Annotated[
        bool, typer.Option("--check", help="Render with each left-out effect, and with all, and compare.")
    ] = False,
    which: Effects = "auto",
    bias_px: LeaveOutPx = AUTO.bias_px,
    variance: LeaveOutVariance = AUTO.variance,
    as_json: Json = False,
) -> None:
    """Which effects a scene calls for, why, their influence and cost. Exit status 1 if --check contradicts."""
    loaded, tolerance = scenes.load(scene), Tolerance(bias_px, variance)
    decisions = effects(loaded, tolerance, which)
    rows = []
    if check_them:
        with progress(f"{loaded.name}: effects") as shown:
            rows = check(loaded, tolerance, progress=shown or (lambda *_: None))
    facts = {
        "scene": loaded.name,
        "tolerance": {"bias_px": bias_px, "variance": variance},
        "effects": [_fact(decision) for decision in decisions],
        "estimated_saving": _saving(decisions),
        "check": [_checked(row) for row in rows],
    }
    if as_json:
        say(facts, True, "")
    else:
        console().print(_table(decisions))
        print(f"Estimated time of everything on, over that of this choice: {_saving(decisions):.1f}")
        if rows:
            console().print(_check_table(rows))
            _total(rows)
    raise typer.Exit(0 if all(row.holds for row in rows) else 1)


def _saving(decisions: tuple[Decision, ...]) -> float:
    """Time of a render with everything over that of this choice: excesses add up, random rays are paid for once."""

    def time(effects: list[Effect]) -> float:
        random = max((effect.cost - 1 for effect in effects if effect.random), default=0.0)
        return 1 + random + sum(effect.cost - 1 for effect in effects if not effect.random)

    rendered = [decision for decision in decisions if decision.effect.name in RENDERED]
    return time([d.effect for d in rendered]) / time([d.effect for d in rendered if d.on])


def _fact(decision: Decision) -> dict:
    effect, (bias, change) = decision.effect, decision.influence
    return {
        "name": effect.name,
        "on": decision.on,
        "reason": decision.reason,
        "bias_px": bias if math.isfinite(bias) else None,
        "variance": change if math.isfinite(change) else None,
        "cost": effect.cost,
        "switch": effect.switch,
    }


def _checked(row: Switched) -> dict:
    bounds = [value if math.isfinite(value) else None for value in row.estimated]
    return {
        "sensor": list(row.setting.sensor),
        "light": list(row.setting.light),
        "effect": row.name,
        "estimated": bounds,
        "measured": [row.bias_px, row.variance],
        "resolution": [row.resolution_px, row.resolution_variance],
        "seconds": row.seconds,
        "seconds_auto": row.seconds_auto,
        "holds": row.holds,
    }


def _number(value: float) -> str:
    return "0" if value == 0 else "large" if not math.isfinite(value) else f"{value:.2g}"


def _table(decisions: tuple[Decision, ...]) -> Table:
    table = Table(title="Effects: influence on the distance, at most", box=None, title_justify="left")
    for name in ("effect", "", "reason"):
        table.add_column(name)
    for name in ("bias px", "variance", "cost"):
        table.add_column(name, justify="right")
    for decision in decisions:
        influence = (_number(value) for value in decision.influence)
        cost = "each picture" if decision.effect.name == "pose_jitter" else f"{decision.effect.cost:.1f}"
        table.add_row(decision.effect.name, "on" if decision.on else "off", decision.reason, *influence, cost)
    table.caption = "variance: relative change. cost: time of a render with it over that without."
    return table


def _check_table(rows: list[Switched]) -> Table:
    table = Table(title="\nSwitched on: measured against the bound", box=None, title_justify="left")
    table.add_column("sensor, light")
    table.add_column("effect")
    for name in ("bias px", "bound", "variance", "bound", "time", ""):
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(
            f"{row.setting.sensor} {row.setting.light}",
            row.name,
            f"{row.bias_px:+.4f}",
            f"{_number(row.estimated.bias_px)} +{row.resolution_px:.4f}",
            f"{row.variance:+.4f}",
            f"{_number(row.estimated.variance)} +{row.resolution_variance:.4f}",
            f"{row.seconds / row.seconds_auto:.1f}",
            "ok" if row.holds else "EXCEEDED",
        )
    table.caption = "bound: estimated, + what the renders scatter by (0.1 %). time: of one render over that of auto."
    return table


def _total(rows: list[Switched]) -> None:
    everything = [row for row in rows if row.name == "all"]
    auto, total = sum(row.seconds_auto for row in everything), sum(row.seconds for row in everything)
    held = sum(row.holds for row in rows)
    print(
        f"{held} of {len(rows)} comparisons within their bounds. auto {auto:.2f} s, all {total:.2f} s: "
        f"{total / auto:.1f} times faster."
    )
