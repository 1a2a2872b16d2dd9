"""``ice validate``."""

from __future__ import annotations

import json
import sys
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from render import Tolerance
from scenes import InvalidInput
from validation.batch import campaign
from validation.batch.job import run
from validation.batch.store import RunFile
from validation.cli.common import AUTO, Effects, Json, LeaveOutPx, LeaveOutVariance, app, progress, stoppable
from validation.cost.goal import check_accuracy, reach, seconds
from validation.report import export
from validation.report.table import console, report


@app.command("validate")
def validate_command(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="A bundled scene, or a TOML file: scene or campaign.")],
    renders: Annotated[int, typer.Option(help="Noisy images a setting.")] = 1000,
    seed: Annotated[int, typer.Option(help="Root of all random numbers.")] = 1995,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Run directory; default runs/SCENE. A killed run continues there."),
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Processes; default: one a core.")] = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Work on the Dask cluster of this scheduler.")
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Start anew even if DIR holds results.")] = False,
    accuracy: Annotated[
        float | None,
        typer.Option(help="Half-width of the 95 % interval on each variance ratio; chooses renders and rays itself."),
    ] = None,
    budget: Annotated[
        str | None, typer.Option(metavar="TIME", help="Instead: the best accuracy for 60s, 2min, ...")
    ] = None,
    effects: Effects = "auto",
    bias_px: LeaveOutPx = AUTO.bias_px,
    variance: LeaveOutVariance = AUTO.variance,
    log_json: Annotated[bool, typer.Option("--log-json", help="Events as JSON lines on standard error.")] = False,
    as_json: Json = False,
) -> None:
    """Predict, render and measure every setting of a scene or a campaign and judge the predictions.

    Writes run.sqlite, table.csv, result.json and pictures to DIR. Exit status 1 if the measurements contradict the
    predictions.
    """
    started = time.perf_counter()
    limit = _goal(accuracy, budget)
    loaded = campaign.load(scene)
    directory = out or Path("runs") / loaded.name
    title = f"{loaded.name}: {len(loaded)} settings"
    simulated = {"effects": effects, "tolerance": Tolerance(bias_px, variance)}
    with stoppable(log_json):
        with nullcontext() if log_json else progress(title) as shown:
            if accuracy is None and limit is None:
                found, goal = run(loaded, renders, seed, directory, workers, fresh, shown, dask=dask, **simulated), None
            else:
                found, goal = reach(
                    loaded, accuracy, limit, seed=seed, out=directory, workers=workers, fresh=fresh, dask=dask,
                    say=lambda line: print(line, file=sys.stderr), progress=shown, started=started,
                    **simulated,
                )  # fmt: skip
        _write(loaded, found, directory)
    if goal:
        goal = replace(goal, seconds=time.perf_counter() - started)
    if as_json:
        print(json.dumps(found.to_json() | ({"goal": goal.to_json()} if goal else {}), indent=1))
    else:
        shown_on = console()
        shown_on.print(report(found))
        if goal:
            shown_on.print(goal.text, highlight=False)
        shown_on.print(f"Run file, table.csv and pictures: {directory}", highlight=False)
    raise typer.Exit(0 if found.verdict.agrees else 1)


def _goal(accuracy: float | None, budget: str | None) -> float | None:
    """Seconds of the budget; both options are checked."""
    if accuracy is not None and budget is not None:
        raise InvalidInput(f"--budget must be given without --accuracy, got both ({budget}, {accuracy:g})")
    if accuracy is not None:
        check_accuracy(accuracy)
    return None if budget is None else seconds(budget)


def _write(loaded: campaign.Campaign, found, directory: Path) -> None:
    from validation.report import figures  # matplotlib takes half a second to load

    export.write_csv(found, directory / "table.csv")
    export.write_json(found, directory / "result.json")
    store = RunFile.reopen(directory)
    try:
        figures.draw(loaded, found, store, directory / "figures")
    finally:
        store.close()
