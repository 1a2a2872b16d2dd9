"""``ice validate``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

import scenes
from validate.commands.common import Json, SceneName, app, progress
from validate.export import write_csv
from validate.run import run
from validate.store import RunFile
from validate.table import console, report


@app.command("validate")
def validate_command(
    scene: SceneName,
    renders: Annotated[int, typer.Option(help="Noisy images a setting.")] = 1000,
    seed: Annotated[int, typer.Option(help="Root of all random numbers.")] = 1,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Run directory; default runs/SCENE. A killed run continues there."),
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Processes; default: one a core.")] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Start anew even if DIR holds results.")] = False,
    as_json: Json = False,
) -> None:
    """Predict, render and measure every setting of a scene and judge the predictions.

    Writes run.sqlite, table.csv and pictures to DIR. Exit status 1 if the measurements contradict the predictions.
    """
    loaded = scenes.load(scene)
    directory = out or Path("runs") / loaded.name
    with progress(f"{loaded.name}: {len(loaded.settings)} settings") as shown:
        found = run(loaded, renders, seed, directory, workers, fresh, shown)
    _write(loaded, found, directory)
    if as_json:
        print(json.dumps(found.to_json(), indent=1))
    else:
        shown_on = console()
        shown_on.print(report(found))
        shown_on.print(f"Run file, table.csv and pictures: {directory}", highlight=False)
    raise typer.Exit(0 if found.verdict.agrees else 1)


def _write(loaded, found, directory: Path) -> None:
    from validate import figures  # matplotlib takes half a second to load

    write_csv(found, directory / "table.csv")
    (directory / "result.json").write_text(json.dumps(found.to_json(), indent=1), encoding="utf-8")
    store = RunFile.reopen(directory)
    try:
        figures.draw(loaded, found, store, directory / "figures")
    finally:
        store.close()
