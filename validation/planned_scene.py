"""The file of a scene with the poses of its plan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import planner
import scenes
from scenes import InvalidInput, Pose
from scenes.board import PITCH
from scenes.files.door import read_toml
from scenes.files.written import edited


def check_writable(source: str) -> Path:
    """The path of a user's own scene.

    Raises
    ------
    InvalidInput
        If it is bundled.
    """
    path = scenes.find(source)
    if source in scenes.names():
        raise InvalidInput(f"--write must be given with a scene file of your own, got the bundled scene {source}")
    return path


def write(path: Path, found: planner.Plan, sensor: Pose, light: Pose | tuple[Pose, ...]) -> None:
    """Put poses, and the lights' shares of a plan, into a scene's file; all else stays, comments too.

    They become the first of its settings, in place of the only one where there is but one.

    Raises
    ------
    InvalidInput
        If the file cannot be written.
    """
    document = _with_first(read_toml(path), sensor, light)
    for table, lit in zip(document.get("lights", []), found.scene.lights, strict=False):
        if found.shares:
            table["intensity"] = lit.intensity
    _save(path, document)


def write_board(path: Path, found: planner.BoardPlan) -> None:
    """Put poses and a board's place and size into a scene's file, as `write` does poses; how well its pitch is known is
    that much a part of it.

    Raises
    ------
    InvalidInput
        If the file cannot be written.
    """
    document = _with_first(read_toml(path), found.picture.sensor, found.light)
    board, told = found.best.board, document["placement"]["board"]
    scale = board.pitch / scenes.load(path).placement.board.pitch
    told |= {"corner": [round(value, 6) for value in board.corner], "shape": list(board.shape)}
    for key in ("pitch", "dot_radius", "marker"):
        if key in told:
            told[key] = _scaled(told[key], scale)
    rows = [row for row in document.get("uncertain", []) if row["key"] == PITCH]
    for row in rows:
        row |= _scaled(row, scale)
    _save(path, document)


def _scaled(told: Any, scale: float) -> Any:
    """A number, or a table that says it and how well it is known, so many times as large."""
    if not isinstance(told, dict):
        return told * scale
    return told | {name: told[name] * scale for name in ("value", "sd", "half_width") if name in told}


def _with_first(document: dict[str, Any], sensor: Pose, light: Pose | tuple[Pose, ...]) -> dict[str, Any]:
    """A scene's document with poses first of its settings, in place of the only one where there is but one."""
    others = document.get("settings", [])
    setting = {"sensor": list(sensor), "light": scenes.pairs(light)}
    return document | {"settings": [setting, *(others if len(others) > 1 else [])]}


def _save(path: Path, document: dict[str, Any]) -> None:
    try:
        path.write_text(edited(path.read_text("utf-8"), document), "utf-8")
    except OSError as error:
        raise InvalidInput(f"--write must be given with a writable file, got {path} ({error.strerror})") from None
    scenes.load(path)
