"""``ice effects``: which effects a scene calls for, and whether that is true."""

from __future__ import annotations

from typing import Annotated

import typer

from validation.cli.common import (
    Effects,
    Json,
    LeaveOutPx,
    LeaveOutVariance,
    SceneName,
    commands,
    progress,
    say,
    scene_of,
    tolerance,
)
from validation.report.terminal import console

commands = commands()


@commands.command("effects")
def effects_command(
    scene: SceneName,
    check_them: Annotated[
        bool, typer.Option("--check", help="Render with each left-out effect, and with all, and compare.")
    ] = False,
    which: Effects = "auto",
    bias_px: LeaveOutPx = None,
    variance: LeaveOutVariance = None,
    as_json: Json = False,
) -> None:
    """Which effects a scene calls for, why, their influence and cost. Exit status 1 if --check contradicts."""
    loaded = scene_of(scene)
    from render.phenomena import effects
    from validation.effects_check import check
    from validation.report import effects_table

    limits = tolerance(bias_px, variance)
    decisions = effects(loaded, limits, which)
    rows = []
    if check_them:
        with progress(f"{loaded.name}: rendering with and without each effect", at_once=True) as shown:
            rows = check(loaded, limits, progress=shown)
    facts = {
        "scene": loaded.name,
        "tolerance": {"bias_px": limits.bias_px, "variance": limits.variance},
        "effects": [effects_table.fact(decision) for decision in decisions],
        "estimated_saving": effects_table.saving(decisions),
        "check": [effects_table.checked(row) for row in rows],
    }
    if as_json:
        say(facts, True, "")
    else:
        console().print(effects_table.table(decisions))
        print(f"Estimated time of everything on, over that of this choice: {facts['estimated_saving']:.1f}")
        if rows:
            console().print(effects_table.check_table(rows))
            print(effects_table.total(rows))
    raise typer.Exit(0 if all(row.holds for row in rows) else 1)
