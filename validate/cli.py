"""The command ``ice``."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

import measure
import render
import scenes
from scenes import InvalidInput, Pose
from validate import picture_file
from validate.export import write_csv
from validate.run import Progress as Report
from validate.run import run
from validate.store import RunFile
from validate.table import console, report

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)

SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="A bundled scene or a TOML file.")]
Sensor = Annotated[str, typer.Option(metavar="P,A", help="Sensor pose: polar angle and azimuth, degrees.")]
LightPose = Annotated[str, typer.Option(metavar="P,A", help="Light pose: polar angle and azimuth, degrees.")]
_UsageError = typer.BadParameter.__base__  # typer does not export it

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]


@app.callback()
def _ice() -> None:
    """Predict how precisely an image will let you measure, and prove it by rendering and re-measuring."""


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
    with _progress(f"{loaded.name}: {len(loaded.settings)} settings") as shown:
        found = run(loaded, renders, seed, directory, workers, fresh, shown)
    _write(loaded, found, directory)
    if as_json:
        print(json.dumps(found.to_json(), indent=1))
    else:
        shown_on = console()
        shown_on.print(report(found))
        shown_on.print(f"Run file, table.csv and pictures: {directory}", highlight=False)
    raise typer.Exit(0 if found.verdict.agrees else 1)


@app.command("render")
def render_command(
    scene: SceneName,
    sensor: Sensor,
    light: LightPose,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help=".png, .tif (float) or .npy")],
    noise_seed: Annotated[int | None, typer.Option(help="Add the sensor's noise, from this seed.")] = None,
    as_json: Json = False,
) -> None:
    """Render one image of a scene."""
    loaded = scenes.load(scene)
    image = render.image(loaded, _pose("--sensor", sensor), _pose("--light", light))
    if noise_seed is not None:
        image = render.expose(image, loaded.noise, np.random.default_rng(noise_seed), 1)[0]
    picture_file.write(output, image)
    facts = {
        "file": str(output),
        "width": image.shape[1],
        "height": image.shape[0],
        "least": float(image.min()),
        "greatest": float(image.max()),
    }
    _say(
        facts,
        as_json,
        f"{output}: {image.shape[1]} x {image.shape[0]} px, grey levels {image.min():.1f} to {image.max():.1f}",
    )


@app.command("measure")
def measure_command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Image of the camera's size.")],
    scene: SceneName,
    sensor: Sensor,
    light: Annotated[str | None, typer.Option(metavar="P,A", help="Light pose; not needed to measure.")] = None,
    locator: Annotated[str, typer.Option(help=" or ".join(measure.LOCATORS))] = "gradient",
    threshold: Annotated[float | None, typer.Option(help="Gradient threshold of canny, grey levels a px.")] = None,
    as_json: Json = False,
) -> None:
    """Measure the scene's distance in an image. Exit status 1 if it cannot be measured."""
    loaded = scenes.load(scene)
    poses = _pose("--sensor", sensor), light and _pose("--light", light)
    found = measure.distance(picture_file.read(file), loaded, *poses, locator, threshold)
    good = bool(np.isfinite(found.value_px))
    facts = {
        "file": str(file),
        "value_px": float(found.value_px) if good else None,
        "variance_px2": float(found.variance_px2) if good else None,
        "status": str(found.status),
        "corners": found.corners.tolist() if good else None,
        "edges": [
            {
                "name": name,
                "status": str(found.edge_status[i]),
                "points": int(found.edge_points[i]),
                "contrast": float(found.edge_contrast[i]),
            }
            for i, name in enumerate(found.edge_names)
        ],
    }
    edges = ", ".join(
        f"{edge['name']} {edge['status']} ({edge['points']} points, contrast {edge['contrast']:.0f})"
        for edge in facts["edges"]
    )
    value = f"{found.value_px:.4f} +- {np.sqrt(found.variance_px2):.4f} px (1 sigma)" if good else "not measured"
    _say(facts, as_json, f"{value}, {found.status}\nedges: {edges}")
    raise typer.Exit(0 if good else 1)


def main() -> None:
    """Entry point: bad input is one line on standard error and exit status 2."""
    try:
        code = app(standalone_mode=False)
    except InvalidInput as error:
        print(error, file=sys.stderr)
        code = 2
    except _UsageError as error:
        print(_usage(error), file=sys.stderr)
        code = 2
    except (typer.Abort, KeyboardInterrupt):
        print("stopped; the same command continues the run", file=sys.stderr)
        code = 130
    sys.exit(code)


def _usage(error: Exception) -> str:
    """A usage error as "X must be ..., got ..."."""
    message = str(error.message).rstrip(".")
    parameter = getattr(error, "param", None)
    if parameter is None:
        unknown = re.match(r"No such (option|command):? '?([^' ]+)'?", message)
        known = f"{unknown[1]} must be a known one (see --help), got {unknown[2]!r}" if unknown else None
        return known or f"the command line must be usable (see --help), got: {message}"
    name = parameter.opts[0] if parameter.opts[0].startswith("-") else parameter.name.upper()
    if not message or message.startswith("Missing"):
        return f"{name} must be given, got nothing"
    problem = getattr(error.__cause__, "errors", lambda: [{}])()[0]
    wanted = re.sub(r"^Input should be |, unable to parse.*$", "", message)
    return f"{name} must be {wanted}, got {problem.get('input')!r}"


def _pose(option: str, text: str) -> Pose:
    try:
        polar, azimuth = (float(part) for part in text.split(","))
        return Pose(polar, azimuth)
    except InvalidInput as error:
        raise InvalidInput(f"{option}: {error}") from None
    except ValueError:
        raise InvalidInput(f"{option} must be two numbers P,A (degrees), got {text!r}") from None


def _say(facts: dict, as_json: bool, text: str) -> None:
    print(json.dumps(facts, indent=1) if as_json else text)


def _write(loaded, found, directory: Path) -> None:
    from validate import figures  # matplotlib takes half a second to load

    write_csv(found, directory / "table.csv")
    (directory / "result.json").write_text(json.dumps(found.to_json(), indent=1), encoding="utf-8")
    store = RunFile.reopen(directory)
    try:
        figures.draw(loaded, found, store, directory / "figures")
    finally:
        store.close()


@contextmanager
def _progress(title: str) -> Iterator[Report | None]:
    """A progress bar on standard error, if that is a terminal."""
    errors = console(stderr=True)
    if not errors.is_terminal:
        yield None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("images"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=errors, transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda _what, done, total: bar.update(task, completed=done, total=total)


if __name__ == "__main__":
    main()
