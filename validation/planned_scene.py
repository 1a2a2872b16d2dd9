"""The file of a scene with the poses of its plan."""

from __future__ import annotations

from pathlib import Path

import planner
import scenes
from scenes import InvalidInput, Pose
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
    document = read_toml(path)
    setting = {"sensor": list(sensor), "light": scenes.pairs(light)}
    others = document.get("settings", [])
    document["settings"] = [setting, *(others if len(others) > 1 else [])]
    for table, lit in zip(document.get("lights", []), found.scene.lights, strict=False):
        if found.shares:
            table["intensity"] = lit.intensity
    try:
        path.write_text(edited(path.read_text("utf-8"), document), "utf-8")
    except OSError as error:
        raise InvalidInput(f"--write must be given with a writable file, got {path} ({error.strerror})") from None
    scenes.load(path)
