"""What the commands of ``ice`` share: the application, common options, one line for bad input, the progress bar."""

from __future__ import annotations

import json
import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from render import Tolerance
from scenes import InvalidInput, Pose
from validation.batch.job import Progress as Report
from validation.batch.stopped import Interrupted
from validation.report.table import console

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)

SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="A bundled scene or a TOML file.")]
Sensor = Annotated[str, typer.Option(metavar="P,A", help="Sensor pose: polar angle and azimuth, degrees.")]
LightPose = Annotated[str, typer.Option(metavar="P,A", help="Light pose: polar angle and azimuth, degrees.")]

AUTO = Tolerance()  # what auto leaves out unless told otherwise
Effects = Annotated[
    str, typer.Option("--effects", metavar="WHICH", help="What is simulated: auto, all, or names with commas between.")
]
LeaveOutPx = Annotated[
    float, typer.Option("--leave-out-px", help="auto leaves out what changes the mean distance by at most this, px.")
]
LeaveOutVariance = Annotated[
    float, typer.Option("--leave-out-variance", help="... and its variance by at most this part.")
]
Seed = Annotated[int, typer.Option(min=0, help="Root of all random numbers.")]
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
def progress(title: str, unit: str = "images") -> Iterator[Report | None]:
    """A progress bar with rate and time left on standard error, if that is a terminal."""
    errors = console(stderr=True)
    if not errors.is_terminal:
        yield None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(unit),
        _Rate(),
        _Left(),
    )
    with Progress(*columns, console=errors, transient=True) as bar:
        task = bar.add_task(title, total=None)

        def report(_what: str, done: int, total: int) -> None:
            if bar.tasks[0].total is None:  # what an earlier session has done says nothing about the rate
                bar.reset(task, completed=done, total=total)
            bar.update(task, completed=done, total=total)

        yield report


class _Rate(ProgressColumn):
    """Images a second."""

    def render(self, task: Task) -> str:
        return "" if not task.speed else f"{task.speed:.0f}/s"


class _Left(TimeRemainingColumn):
    """Time left, in words."""

    def render(self, task: Task) -> Text:
        return super().render(task) + " left"


@contextmanager
def stoppable(log_json: bool) -> Iterator[None]:
    """Ctrl-C and SIGTERM raise `Interrupted`; with ``log_json`` every event is a JSON line on standard error."""
    log, shown = logging.getLogger("validation"), logging.StreamHandler()
    if log_json:
        shown.setFormatter(_JsonLine())
        log.addHandler(shown)
        log.setLevel(logging.INFO)
    former = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted("interrupted", 130) from None
    finally:
        signal.signal(signal.SIGTERM, former)
        log.removeHandler(shown)


def _terminate(*_) -> None:
    raise Interrupted("terminated", 143)


class _JsonLine(logging.Formatter):
    """One JSON object a line: time (seconds since 1970), event, and the event's facts."""

    def format(self, record: logging.LogRecord) -> str:
        return json.dumps({"time": record.created, "event": record.getMessage(), **getattr(record, "facts", {})})
