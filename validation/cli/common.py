"""What the commands of ``ice`` share: common options, poses, progress. Loads little, as do the commands themselves."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from inspect import signature
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_type_hints

import typer

from scenes import InvalidInput, Picture, Pose, Scene, load
from validation.batch.stopped import CONTINUE, Interrupted, interruption
from validation.cli import verbosity
from validation.report.terminal import console
from validation.strict_json import dumps

if TYPE_CHECKING:
    from render import EffectTolerance

Report = Callable[[str, int, int], None]
Given = TypeVar("Given")

MOST_SEED = 2**63 - 1
MOST_WORKERS = 1024
_EVERY_S, _SOON_S = 10.0, 3.0  # between lines of progress where there is no terminal
_FIRST_S = 0.7  # before the first

SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="A bundled scene or a TOML file.")]
Sensor = Annotated[str, typer.Option(metavar="P,A", help="Sensor pose: polar angle and azimuth, degrees.")]
LightPose = Annotated[
    str | None, typer.Option(metavar="P,A", help='Pose of the free light, or of each: "P,A P,A", degrees.')
]
Effects = Annotated[
    str, typer.Option("--effects", metavar="WHICH", help="What is simulated: auto, all, or names with commas between.")
]
LeaveOutPx = Annotated[
    float | None,
    typer.Option("--leave-out-px", help="auto leaves out what changes the mean distance by at most this, px."),
]
LeaveOutVariance = Annotated[
    float | None, typer.Option("--leave-out-variance", help="... and its variance by at most this part.")
]
Seed = Annotated[int, typer.Option(help="Root of all random numbers.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]


def commands() -> typer.Typer:
    """What a module adds its commands to."""
    return typer.Typer(pretty_exceptions_enable=False, rich_markup_mode=None)


def taking(options: type[Given]) -> Callable[[Callable[[Given], None]], Callable[..., None]]:
    """A command whose arguments and options are the fields of a dataclass, which the function is given."""
    hints = get_type_hints(options, include_extras=True)

    def made(function: Callable[[Given], None]) -> Callable[..., None]:
        @wraps(function)
        def command(*arguments: Any, **named: Any) -> None:
            function(options(*arguments, **named))

        told = signature(options)
        parameters = [each.replace(annotation=hints[name]) for name, each in told.parameters.items()]
        told = told.replace(parameters=parameters, return_annotation=None)
        command.__signature__ = told  # ty: ignore[missing-attribute]
        command.__annotations__ = hints | {"return": None}
        return command

    return made


def scene_of(name: str) -> Scene:
    """A scene; on standard error what its part's file leaves open."""
    scene = load(name)
    warn_of_open(scene)
    return scene


def warn_of_open(*several: Scene) -> None:
    """Say on standard error what the files of scenes' parts leave open."""
    for scene in several:
        if scene.solid.caps and not verbosity.quiet():
            print(f"Warning: object.file has {scene.solid.mended[-1]}, and no plan looks at them", file=sys.stderr)


def tolerance(bias_px: float | None, variance: float | None) -> EffectTolerance:
    """What ``auto`` may leave out: its own limits where none are given."""
    from render import EffectTolerance

    given = {"bias_px": bias_px, "variance": variance}
    return EffectTolerance(**{name: value for name, value in given.items() if value is not None})


def check_number(option: str, value: float | None, least: float, most: float) -> None:
    """See that a number is in its range, if it is given.

    Raises
    ------
    InvalidInput
        If it is not.
    """
    if value is not None and not value >= least:
        raise InvalidInput(f"{option} must be at least {least}, got {value}")
    if value is not None and not value <= most:
        raise InvalidInput(f"{option} must be at most {most}, got {value}")


def first_picture(scene: Scene, sensor: Any, light: Any) -> Picture:
    """Of the poses that are given, the others as in the scene's first setting."""
    first = scene.settings[0] if scene.settings else None
    if first is None and (sensor is None or (light is None and scene.free)):
        raise InvalidInput("--sensor and --light must be given for a scene without settings, got none")
    sensor = first.sensor if sensor is None else sensor
    light = first.light if light is None and first is not None else light
    return Picture.of(scene, sensor, () if light is None else light)


def check_left_out(context: typer.Context, where: str, *options: str) -> None:
    """See that options that have no use with another are not given to the command that runs.

    Raises
    ------
    InvalidInput
        If one is.
    """
    for parameter in context.command.params:
        given = context.get_parameter_source(parameter.name).name == "COMMANDLINE"
        if given and parameter.opts[0] in options:
            value = context.params[parameter.name]
            told = " ".join(value) if isinstance(value, list) else value
            raise InvalidInput(f"{parameter.opts[0]} must be left out with {where}, got {told}")


def check_seed(seed: int | None, option: str = "seed") -> None:
    """See that a seed is one."""
    check_number(option, seed, 0, MOST_SEED)


def parse_pose(option: str, text: str) -> Pose:
    try:
        polar, azimuth = (float(part) for part in text.split(","))
        return Pose(polar, azimuth)
    except InvalidInput as error:
        raise InvalidInput(f"{option}: {error}") from None
    except ValueError:
        raise InvalidInput(f"{option} must be two numbers P,A (degrees), got {text!r}") from None


def parse_poses(option: str, text: str | None) -> Pose | tuple[Pose, ...] | None:
    """One pose, or several with spaces between; None where nothing is given."""
    if text is None:
        return None
    found = tuple(parse_pose(option, part) for part in text.split())
    return found[0] if len(found) == 1 else found


def say(facts: dict, as_json: bool, text: str) -> None:
    """Print a command's facts: as JSON, or the text."""
    print(dumps(facts) if as_json else text)


@contextmanager
def progress(title: str, unit: str = "images", at_once: bool = False) -> Iterator[Report]:
    """Progress on standard error: a bar with rate and time left if that is a terminal, else a line every 10 s.

    ``at_once`` says already in the first second that there is work, and then a line every 3 s.
    """
    if verbosity.quiet():
        yield lambda *_: None
        return
    errors = console(stderr=True)
    if not errors.is_terminal:
        first = threading.Timer(_FIRST_S, lambda: print(f"{title} ...", file=sys.stderr, flush=True))
        first.daemon = True
        if at_once:
            first.start()  # what is refused at once is one line
        try:
            yield _lines(title, unit, at_once)
        finally:
            first.cancel()
        return
    from validation.cli.bar import bar

    with bar(errors, title, unit, at_once) as report:
        yield report


def _lines(title: str, unit: str, at_once: bool) -> Report:
    told, every_s = time.monotonic(), _SOON_S if at_once else _EVERY_S

    def report(what: str, done: int, total: int) -> None:
        nonlocal told
        if time.monotonic() - told >= every_s:
            told = time.monotonic()
            named = f"{what}, " if at_once else ""
            print(f"{title}: {named}{done} of {total} {unit}", file=sys.stderr, flush=True)

    return report


@contextmanager
def continued(log_json: bool) -> Iterator[None]:
    """Say of an interruption that the run can be continued; with ``log_json`` every event is a JSON line on stderr."""
    log, shown = logging.getLogger("validation"), logging.StreamHandler()
    if log_json:
        shown.setFormatter(_JsonLine())
        log.addHandler(shown)
        log.setLevel(logging.INFO)
    try:
        yield
    except BaseException as error:
        if stop := interruption(error):
            raise Interrupted(f"{stop.word}; {CONTINUE}", stop.status) from None
        raise
    finally:
        log.removeHandler(shown)


class _JsonLine(logging.Formatter):
    """One JSON object a line: time (seconds since 1970), event, and the event's facts."""

    def format(self, record: logging.LogRecord) -> str:
        facts = getattr(record, "facts", {})
        return dumps({"time": record.created, "event": record.getMessage(), **facts}, indent=None)
