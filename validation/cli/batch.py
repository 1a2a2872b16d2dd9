"""``ice validate``."""

from __future__ import annotations

import sys
import time
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenes import InvalidInput
from validation.batch import campaign
from validation.batch.shard import Shard
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
    taking,
    tolerance,
    warn_of_open,
)
from validation.cli.outputs import check_directory
from validation.defaults import DEFAULT_SEED
from validation.report.terminal import console

if TYPE_CHECKING:
    from validation.batch import photographs
    from validation.batch.options import RunOptions
    from validation.batch.result import Validation
    from validation.cost.goal import Goal, Reached
    from validation.report.station import Station

commands = commands()
_MOST_RENDERS = 10_000_000
_MOST_TOLD = 20  # photographs that are left out


@dataclass(frozen=True)
class Options:
    """What a validation is asked for."""

    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A bundled scene, or a TOML file: scene or campaign.")]
    renders: Annotated[int, typer.Option(help="Noisy images a setting.")] = 1000
    seed: Seed = DEFAULT_SEED
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Run directory; default runs/SCENE. A killed run continues there."),
    ] = None
    workers: Annotated[int | None, typer.Option(help="Processes; default: one a core.")] = None
    dask: Annotated[str | None, typer.Option(metavar="ADDRESS", help="Work on the Dask cluster of this scheduler.")] = (
        None
    )
    shard: Annotated[
        str | None,
        typer.Option(metavar="I/N", help="Only the I-th of N parts of the settings; `ice merge` puts them together."),
    ] = None
    fresh: Annotated[bool, typer.Option("--fresh", help="Start anew even if DIR holds results.")] = False
    accuracy: Annotated[
        float | None,
        typer.Option(help="Half-width of the 95 % interval on each variance ratio; chooses renders and rays itself."),
    ] = None
    budget: Annotated[
        str | None, typer.Option(metavar="TIME", help="Instead: the best accuracy for 60s, 2min, ...")
    ] = None
    effects: Effects = "auto"
    bias_px: LeaveOutPx = None
    variance: LeaveOutVariance = None
    photos: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Measure these photographs instead of renders: a sub-folder a setting."),
    ] = None
    exact_poses: Annotated[
        bool,
        typer.Option("--exact-poses", help="With --photos: poses are exactly those said, so judge mean errors, too."),
    ] = False
    estimators: Annotated[
        str | None, typer.Option(metavar="LIST", help="By which is measured, with commas between; the first is judged.")
    ] = None
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit status 1 also where a row is not proven or not measured.")
    ] = False
    explain: Annotated[bool, typer.Option("--explain", help="Explain all terms of the tables at length.")] = False
    log_json: Annotated[bool, typer.Option("--log-json", help="Events as JSON lines on standard error.")] = False
    as_json: Json = False

    def of_run(self, directory: Path) -> RunOptions:
        """How the run works."""
        from validation.batch.options import RunOptions
        from validation.batch.work import Rendering

        rendering = Rendering(effects=self.effects, tolerance=tolerance(self.bias_px, self.variance))
        shard = Shard() if self.shard is None else Shard.parse(self.shard)
        return RunOptions(self.seed, directory, self.workers, self.fresh, self.dask, rendering=rendering, shard=shard)


@dataclass(frozen=True)
class Finished:
    """A run's campaign, directory and outcome, the station that its page shows, and the goal that it has reached."""

    campaign: campaign.Campaign
    directory: Path
    found: Validation
    station: Station
    reached: Reached | None


@commands.command("validate")
@taking(Options)
def validate_command(given: Options) -> None:
    """Predict, render and measure every setting of a scene or a campaign and judge the predictions.

    With --photos nothing is rendered: repeated photographs are measured instead. Sub-folders of DIR are named as
    sensor_30_90_light_15_270, or DIR holds photos.toml: [[settings]] with sensor, light and files.

    Writes run.sqlite, report.html (one page that shows all), report.md, table.csv, measurands.csv, result.json and
    pictures to DIR. Exit status 1 if the measurements contradict the predictions; with --strict also if a row is not
    proven or not measured.
    """
    started = time.perf_counter()
    check_number("renders", given.renders, 2, _MOST_RENDERS)
    check_number("workers", given.workers, 1, MOST_WORKERS)
    check_seed(given.seed)
    loaded = campaign.load(given.scene)
    warn_of_open(*loaded.scenes)
    loaded = loaded if given.estimators is None else _measured_by(loaded, given.estimators)
    directory = given.out or Path("runs") / loaded.name
    check_directory("--out", directory)
    goal = _goal(given.accuracy, given.budget, started)
    if goal is not None and given.shard is not None:
        raise InvalidInput(f"--shard must be given without --accuracy and --budget, got {given.shard}")
    taken = _photographs(loaded, given.photos, given.exact_poses, goal is not None)
    done = _run(given, taken.campaign if taken else loaded, directory, goal, taken)
    if given.as_json:
        _print_json(done, taken)
    else:
        _print_tables(done, given)
    verdict = done.found.verdict
    shown = verdict.agrees and not (given.strict and (verdict.not_proven or verdict.not_measured))
    raise typer.Exit(0 if shown else 1)


def _run(
    given: Options, loaded: campaign.Campaign, directory: Path, goal: Goal | None, taken: photographs.Photographs | None
) -> Finished:
    """Work until all is done, and write all files."""
    from validation.batch.job import run_by
    from validation.cost.goal import reach

    options, reached = given.of_run(directory), None
    with continued(given.log_json):
        with nullcontext() if given.log_json else progress(f"{loaded.name}: {len(loaded)} settings") as shown:
            if goal is None:
                found = run_by(options, loaded, given.renders, shown, photos=taken)
            else:
                found, reached = reach(loaded, goal, options, lambda line: print(line, file=sys.stderr), shown)
        station = write_files(loaded, found, directory)
    reached = reached and replace(reached, seconds=time.perf_counter() - goal.started)
    return Finished(loaded, directory, found, station, reached)


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


def _print_json(done: Finished, taken: photographs.Photographs | None) -> None:
    from validation.batch.document import pieces

    more = {"goal": done.reached.to_json()} if done.reached else {}
    sys.stdout.writelines(pieces(done.found, more | ({"left_out": list(taken.left_out)} if taken else {})))
    print()


def _print_tables(done: Finished, given: Options) -> None:
    """The whole result as tables."""
    from validation.report import guide, station_text
    from validation.report.run_cells import far
    from validation.report.station import reasons
    from validation.report.table import report

    loaded, found, station = done.campaign, done.found, done.station
    scene = None if loaded.grid or loaded.sweep or len(loaded.scenes) > 1 else given.scene
    shown_on = console()
    shown_on.print(report(found, given.explain, reasons(loaded, far(found)[0])))
    shown_on.print(station_text.report(station.requirements, guide.station_title(found, station)), highlight=False)
    if done.reached:
        shown_on.print(done.reached.text, highlight=False)
    for line in (guide.directory_line(done.directory), guide.next_line(found, scene, done.directory)):
        shown_on.print(line, highlight=False, soft_wrap=True)


def _goal(accuracy: float | None, budget: str | None, started: float) -> Goal | None:
    """What the run is to reach, if anything; both options are checked."""
    from validation.cost.goal import Goal, seconds

    if accuracy is not None and budget is not None:
        raise InvalidInput(f"--budget must be given without --accuracy, got both ({budget}, {accuracy:g})")
    if accuracy is None and budget is None:
        return None
    return Goal(accuracy, None if budget is None else seconds(budget), started)


def write_files(loaded: campaign.Campaign, found: Validation, directory: Path) -> Station:
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
