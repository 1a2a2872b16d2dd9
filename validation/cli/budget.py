"""``ice budget``."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import scenes
from validation.cli.common import (
    Json,
    SceneName,
    Seed,
    check_number,
    check_seed,
    commands,
    first_picture,
    parse_pose,
    parse_poses,
    progress,
    say,
    scene_of,
    taking,
)
from validation.cli.outputs import check_directory, check_file
from validation.defaults import DEFAULT_SEED
from validation.report.terminal import console
from validation.strict_json import dumps

if TYPE_CHECKING:
    from planner import InstallationBox
    from planner.budgeting.budgets import SceneBudget
    from planner.uncertainty.budget import Budget

commands = commands()
_MOST_DRAWS, _FEWEST_PICTURES, _MOST_PICTURES = 10_000_000, 50, 100_000

Pair = Annotated[
    str | None, typer.Option(metavar="P,A", help="Polar angle and azimuth; the first setting's if left out.")
]


@dataclass(frozen=True)
class Options:
    """What a budget is asked for."""

    scene: SceneName
    sensor: Pair = None
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Of the free light, or of each.")] = None
    p: Annotated[float, typer.Option("--p", help="Coverage probability.")] = 0.95
    render: Annotated[bool, typer.Option("--render", help="Noise and bias by simulation, also where formulas do.")] = (
        False
    )
    monte_carlo: Annotated[
        bool, typer.Option("--monte-carlo", help="Draw all inputs, and compare as JCGM 101 clause 8 asks.")
    ] = False
    stations: Annotated[
        int, typer.Option(metavar="N", help="Measure pictures of N drawn stations, too; plain scenes only.")
    ] = 0
    reach: Annotated[
        float | None, typer.Option(metavar="U", help="Which input would have to be how well known for this U?")
    ] = None
    box: Annotated[
        float | None,
        typer.Option(metavar="K", help="How far may both poses be off, for U within half the tolerance over K?"),
    ] = None
    csv_file: Annotated[Path | None, typer.Option("--csv", metavar="FILE.csv", help="Write all contributions.")] = None
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Write budget.html (one page that shows all), budget.json, budget.csv and budget.png."
        ),
    ] = None
    seed: Seed = DEFAULT_SEED
    as_json: Json = False


@commands.command("budget")
@taking(Options)
def budget_command(given: Options) -> None:
    """The uncertainty of every measurand: each source, its share, and the expanded uncertainty."""
    _check(given)
    poses = None if given.sensor is None else parse_pose("--sensor", given.sensor), parse_poses("--light", given.light)
    loaded = scene_of(given.scene)
    from imaging.light.appearance import is_plain
    from validation import boxes, budgets

    picture = first_picture(loaded, *poses)
    if given.stations and not is_plain(loaded):
        raise scenes.InvalidInput(f"--stations must be 0 but for one convex body before darkness, got {given.stations}")
    box = None if given.box is None else _box(picture, given)
    with progress("simulating the picture for its bias", "renders", at_once=True):
        found = budgets.budget_of(picture, given.p, rendered=given.render)
    drawn = budgets.monte_carlo(found, given.seed) if given.monte_carlo else []
    shown = budgets.pictured(found, given.stations, given.seed) if given.stations else None
    facts = budgets.facts(found, drawn, shown, given.reach) | {"box": box and boxes.facts(box)}
    if given.out:
        _write(found, facts, given.out)
    if given.csv_file:
        write_csv(found, given.csv_file)
    if given.as_json:
        say(facts, True, "")
        return
    _show(found, drawn, shown, given.reach)
    for line in boxes.said(box) if box else ():
        console().print(line, highlight=False)
    if given.out:
        console().print(f"budget.html, budget.json, budget.csv and budget.png: {given.out}", highlight=False)


def _box(picture: scenes.Picture, given: Options) -> InstallationBox:
    import planner

    with progress(f"{picture.scene.name}: proving that poses keep U", "cells", at_once=True) as shown:
        return planner.installation_box(picture, k=given.box, p=given.p, report=shown)


def _check(given: Options) -> None:
    check_number("--p", given.p, 0.5, 0.9999)
    check_number("--stations", given.stations, 0, _MOST_PICTURES)
    if 0 < given.stations < _FEWEST_PICTURES:
        raise scenes.InvalidInput(f"--stations must be 0 or at least {_FEWEST_PICTURES}, got {given.stations}")
    if given.reach is not None and not (given.reach > 0 and math.isfinite(given.reach)):
        raise scenes.InvalidInput(f"--reach must be greater than 0, got {given.reach}")
    if given.box is not None and not (given.box > 0 and math.isfinite(given.box)):
        raise scenes.InvalidInput(f"--box must be greater than 0, got {given.box}")
    check_seed(given.seed)
    check_file("--csv", given.csv_file, ".csv")
    check_directory("--out", given.out)


def _write(found: SceneBudget, facts: dict, out: Path) -> None:
    """All that is known, as files of a directory."""
    from validation.report import budget_figure, page, station

    scene = found.picture.scene
    out.mkdir(parents=True, exist_ok=True)
    (out / "budget.json").write_text(dumps(facts), encoding="utf-8")
    write_csv(found, out / "budget.csv")
    budget_figure.draw(found, out / "budget.png")
    page.write_station(station.of_budget(found), scene.title or scene.name, out / "budget.html")


def write_csv(found: SceneBudget, path: Path) -> None:
    """One row a measurand and contribution."""
    rows = found.as_rows()
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _show(found: SceneBudget, drawn: list[dict], shown: dict | None, reach: float | None) -> None:
    from validation import budgets
    from validation.report import budget_table, station, station_text

    terminal = console()
    for m, each in enumerate(found):
        terminal.print(budget_table.table(each))
        terminal.print(f" {budget_table.summary(each)}", highlight=False)
        for line in _further(found, each, drawn, reach):
            terminal.print(f" {line}", highlight=False)
        terminal.print(f" {budget_table.signed(found, m)}\n", style="bold", highlight=False)
    for line in budget_table.TERMS:
        terminal.print(f" {line}", highlight=False)
    if shown:
        for line in budgets.said_of_pictures(shown):
            terminal.print(line, highlight=False)
    terminal.print(station_text.report(station.of_budget(found).requirements, "\nAll requirements"), highlight=False)


def _further(found: SceneBudget, each: Budget, drawn: list[dict], reach: float | None) -> list[str]:
    from validation import budgets

    lines = [budgets.said_of_draws(row) for row in drawn if row["name"] == each.name]
    lines += budgets.said_of_tolerance(found, each)
    lines += budgets.said_of_improvement(each)
    return lines + (budgets.said_of_reach(each, reach) if reach is not None else [])
