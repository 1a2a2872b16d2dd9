"""``ice validate``."""

from __future__ import annotations

import sys
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenes import InvalidInput
from validation.batch import campaign
from validation.cli.common import (
    MOST_WORKERS,
    Effects,
    Json,
    LeaveOutPx,
    LeaveOutVariance,
    Seed,
    check_number,
    check_seed,
    commands,
    continued,
    progress,
    tolerance,
)
from validation.cli.outputs import check_directory
from validation.defaults import DEFAULT_SEED
from validation.report.terminal import console

if TYPE_CHECKING:
    from validation.batch import photographs
    from validation.batch.result import Validation
    from validation.cost.goal import Goal, Reached
    from validation.report.station import Station

commands = commands()
_MOST_RENDERS = 10_000_000
_MOST_TOLD = 20  # photographs that are left out

Target = Annotated[str, typer.Argument(metavar="SCENE", help="A bundled scene, or a TOML file: scene or campaign.")]
Renders = Annotated[int, typer.Option(help="Noisy images a setting.")]
Out = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Run directory; default runs/SCENE. A killed run continues there.")
]
Workers = Annotated[int | None, typer.Option(help="Processes; default: one a core.")]
Dask = Annotated[str | None, typer.Option(metavar="ADDRESS", help="Work on the Dask cluster of this scheduler.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Start anew even if DIR holds results.")]
Accuracy = Annotated[
    float | None,
    typer.Option(help="Half-width of the 95 % interval on each variance ratio; chooses renders and rays itself."),
]
Budget = Annotated[str | None, typer.Option(metavar="TIME", help="Instead: the best accuracy for 60s, 2min, ...")]
Photos = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Measure these photographs instead of renders: a sub-folder a setting."),
]
ExactPoses = Annotated[
    bool, typer.Option("--exact-poses", help="With --photos: poses are exactly those said, so judge mean errors, too.")
]
Estimators = Annotated[
    str | None,
    typer.Option(
        "--estimators", metavar="LIST", help="By which is measured, with commas between; the first is judged."
    ),
]
Strict = Annotated[bool, typer.Option("--strict", help="Exit status 1 also where a row is not proven or not measured.")]
Explain = Annotated[bool, typer.Option("--explain", help="Explain all terms of the tables at length.")]
LogJson = Annotated[bool, typer.Option("--log-json", help="Events as JSON lines on standard error.")]


@commands.command("validate")
def validate_command(
    scene: Target,
    renders: Renders = 1000,
    seed: Seed = DEFAULT_SEED,
    out: Out = None,
    workers: Workers = None,
    dask: Dask = None,
    fresh: Fresh = False,
    accuracy: Accuracy = None,
    budget: Budget = None,
    effects: Effects = "auto",
    bias_px: LeaveOutPx = None,
    variance: LeaveOutVariance = None,
    photos: Photos = None,
    exact_poses: ExactPoses = False,
    estimators: Estimators = None,
    strict: Strict = False,
    explain: Explain = False,
    log_json: LogJson = False,
    as_json: Json = False,
) -> None:
    """Predict, render and measure every setting of a scene or a campaign and judge the predictions.

    With --photos nothing is rendered: repeated photographs are measured instead. Sub-folders of DIR are named as
    sensor_30_90_light_15_270, or DIR holds photos.toml: [[settings]] with sensor, light and files.

    Writes run.sqlite, report.html (one page that shows all), report.md, table.csv, measurands.csv, result.json and
    pictures to DIR. Exit status 1 if the measurements contradict the predictions; with --strict also if a row is not
    proven or not measured.
    """
    started = time.perf_counter()
    check_number("renders", renders, 2, _MOST_RENDERS)
    check_number("workers", workers, 1, MOST_WORKERS)
    check_seed(seed)
    loaded = campaign.load(scene)
    loaded = loaded if estimators is None else _measured_by(loaded, estimators)
    out = out or Path("runs") / loaded.name
    check_directory("--out", out)
    from validation.batch.job import run_by
    from validation.batch.options import RunOptions
    from validation.batch.work import Rendering
    from validation.cost.goal import reach

    goal = _goal(accuracy, budget, started)
    taken = _photographs(loaded, photos, exact_poses, goal is not None)
    loaded = taken.campaign if taken else loaded
    rendering = Rendering(effects=effects, tolerance=tolerance(bias_px, variance))
    options = RunOptions(seed, out, workers, fresh, dask, rendering=rendering)
    with continued(log_json):
        with nullcontext() if log_json else progress(f"{loaded.name}: {len(loaded)} settings") as shown:
            if goal is None:
                found, reached = run_by(options, loaded, renders, shown, photos=taken), None
            else:
                found, reached = reach(loaded, goal, options, lambda line: print(line, file=sys.stderr), shown)
        station = _write(loaded, found, out)
    reached = reached and replace(reached, seconds=time.perf_counter() - started)
    if as_json:
        _print_json(found, reached, taken)
    else:
        one = None if loaded.grid or loaded.sweep or len(loaded.scenes) > 1 else scene
        _print_tables(loaded, found, reached, station, out, one, explain)
    shown = found.verdict.agrees and not (strict and (found.verdict.not_proven or found.verdict.not_measured))
    raise typer.Exit(0 if shown else 1)


def _measured_by(loaded: campaign.Campaign, estimators: str) -> campaign.Campaign:
    """By estimators of a list with commas between, each of which there must be."""
    from validation.batch.work import methods

    loaded = loaded.measured_by(tuple(name.strip() for name in estimators.split(",")))
    for scene in loaded.scenes:
        methods(scene)
    return loaded


def _photographs(
    loaded: campaign.Campaign, folder: Path | None, exact_poses: bool, goal: bool
) -> photographs.Photographs | None:
    """The photographs of a folder, if one is given; those left out are told of."""
    if folder is None:
        if exact_poses:
            raise InvalidInput("--exact-poses must be given with --photos, got it alone")
        return None
    if goal:
        raise InvalidInput("--photos must be given without --accuracy and --budget, got both")
    from validation.batch import photographs

    with progress(f"{loaded.name}: reading", unit="photographs") as shown:
        taken = photographs.load(loaded, folder, exact_poses, shown)
    for reason in taken.left_out[:_MOST_TOLD]:
        print(f"left out: {reason}", file=sys.stderr)
    if len(taken.left_out) > _MOST_TOLD:
        print(f"left out: {len(taken.left_out) - _MOST_TOLD} more photographs", file=sys.stderr)
    return taken


def _print_json(found: Validation, goal: Reached | None, taken: photographs.Photographs | None) -> None:
    from validation.batch.document import pieces

    more = ({"goal": goal.to_json()} if goal else {}) | ({"left_out": list(taken.left_out)} if taken else {})
    sys.stdout.writelines(pieces(found, more))
    print()


def _print_tables(
    loaded: campaign.Campaign, found: Validation, goal: Reached | None, station: Station, directory: Path,
    scene: str | None, explain: bool,
) -> None:  # fmt: skip
    """The whole result as tables; ``scene`` as it was named, None of a campaign."""
    from validation.report import guide, station_text
    from validation.report.run_cells import far
    from validation.report.station import reasons
    from validation.report.table import report

    shown_on = console()
    shown_on.print(report(found, explain, reasons(loaded, far(found)[0])))
    shown_on.print(station_text.report(station.requirements, guide.station_title(found, station)), highlight=False)
    if goal:
        shown_on.print(goal.text, highlight=False)
    for line in (guide.directory_line(directory), guide.next_line(found, scene, directory)):
        shown_on.print(line, highlight=False, soft_wrap=True)


def _goal(accuracy: float | None, budget: str | None, started: float) -> Goal | None:
    """What the run is to reach, if anything; both options are checked."""
    from validation.cost.goal import Goal, seconds

    if accuracy is not None and budget is not None:
        raise InvalidInput(f"--budget must be given without --accuracy, got both ({budget}, {accuracy:g})")
    if accuracy is None and budget is None:
        return None
    return Goal(accuracy, None if budget is None else seconds(budget), started)


def _write(loaded: campaign.Campaign, found: Validation, directory: Path) -> Station:
    """All files of a run; the station that they show."""
    from validation.batch.store import RunFile
    from validation.report import export, figures, page
    from validation.report.station import of_run

    export.write_csv(found, directory / "table.csv")
    export.write_measurands(found, directory / "measurands.csv")
    export.write_json(found, directory / "result.json")
    store = RunFile.reopen(directory)
    try:
        figures.draw(loaded, found, store, directory / "figures")
        station = of_run(loaded, found, store)
        page.write(loaded, found, store, station, directory)
        return station
    finally:
        store.close()
