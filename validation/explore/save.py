"""A state is saved as more settings of a copy of the scene's file: one for each view that is kept, and its own."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from scenes import InvalidInput, Pose, Scene, Setting
from scenes.load import find, from_document
from validation.explore.state import State

_NO_LINK = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


class Exists(InvalidInput):
    """A file is there already, and nobody said that it may be replaced."""


def save(source: str, state: State, directory: Path, *, replace: bool = False) -> Path:
    """Write ``NAME-explored.toml``: the scene's text as it is, the paths of files in it mended, the setting behind.

    Parameters
    ----------
    source : str
        Name of a bundled scene, or path of a TOML file.
    state : State
    directory : Path
        Where to write.
    replace : bool
        Whether a file that is there may be replaced.

    Raises
    ------
    Exists
        If a file is there and may not be replaced.
    InvalidInput
        If the scene with the setting is none, or cannot be written.
    """
    origin = find(source)
    target = directory / f"{origin.stem.removesuffix('-explored')}-explored.toml"
    text = _moved(origin.read_text(encoding="utf-8"), origin.parent, directory)
    text = f"{text.rstrip()}\n\n{settings(state)}"
    _check(target, text)
    _write(target, text, os.O_TRUNC if replace else os.O_EXCL)
    return target


def _write(target: Path, text: str, how: int) -> None:
    """Write a file of the directory itself: what a link there names is not ours, there already or not."""
    try:
        number = os.open(target, os.O_WRONLY | os.O_CREAT | how | _NO_LINK, 0o666)
        with os.fdopen(number, "w", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise Exists(f"{target} must be a new file, got one that exists") from None
    except OSError as error:
        reason = "a link" if target.is_symlink() else error.strerror
        raise InvalidInput(f"{target} must be a file that can be written, got {reason}") from None


def settings(state: State) -> str:
    """The settings as TOML.

    >>> print(settings(State(Pose(30, 90), (Pose(15, 270.25),))))
    [[settings]] # of ice explore
    sensor = [30, 90]
    light = [15, 270.25]
    <BLANKLINE>
    """
    return "\n".join(map(_setting, (*state.views, state.setting)))


def _setting(each: Setting) -> str:
    lines = ["[[settings]] # of ice explore", f"sensor = {_pair(each.sensor)}"]
    if len(each.lights) == 1:
        lines.append(f"light = {_pair(each.lights[0])}")
    elif each.lights:
        lines.append(f"light = [{', '.join(map(_pair, each.lights))}]")
    return "\n".join(lines) + "\n"


def _pair(pose: Pose) -> str:
    return f"[{pose.polar_deg:.10g}, {pose.azimuth_deg:.10g}]"


def _moved(text: str, origin: Path, directory: Path) -> str:
    """Names of files that stand beside the scene, written as they are reached from another directory."""
    for name in set(_texts(tomllib.loads(text))):
        if name and not Path(name).is_absolute() and (origin / name).is_file():
            there = Path(os.path.relpath(origin / name, directory)).as_posix()
            text = re.sub(rf"""(?<==)(\s*)(["']){re.escape(name)}\2""", lambda m, t=there: f'{m[1]}"{t}"', text)
    return text


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _texts(each)


def _check(target: Path, text: str) -> Scene:
    try:
        return from_document(target, tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise InvalidInput(f"{target}: settings must be tables that can be added to, got {error}") from None
