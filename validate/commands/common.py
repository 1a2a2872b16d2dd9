"""What the commands of ``ice`` share: the application, common options, one line for bad input, the progress bar."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from scenes import InvalidInput, Pose
from validate.run import Progress as Report
from validate.table import console

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)

SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="A bundled scene or a TOML file.")]
Sensor = Annotated[str, typer.Option(metavar="P,A", help="Sensor pose: polar angle and azimuth, degrees.")]
LightPose = Annotated[str, typer.Option(metavar="P,A", help="Light pose: polar angle and azimuth, degrees.")]

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]


@app.callback()
def _ice() -> None:
    """Predict how precisely an image will let you measure, and prove it by rendering and re-measuring."""


def parse_pose(option: str, text: str) -> Pose:
    try:
        polar, azimuth = (float(part) for part in text.split(","))
        return Pose(polar, azimuth)
    except InvalidInput as error:
        raise InvalidInput(f"{option}: {error}") from None
    except ValueError:
        raise InvalidInput(f"{option} must be two numbers P,A (degrees), got {text!r}") from None


def say(facts: dict, as_json: bool, text: str) -> None:
    """Print a command's facts: as JSON, or the text."""
    print(json.dumps(facts, indent=1) if as_json else text)


@contextmanager
def progress(title: str) -> Iterator[Report | None]:
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
