"""A scene's file made from another one's: comments stay, and the files that it names are found from where it lies."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import scenes
from scenes import InvalidInput, Scene
from scenes.files.written import edited


def write(document: dict[str, Any], origin: Path, path: Path, option: str, head: str = "") -> Scene:
    """Write a document as a scene's file, with the text of another; the scene that it says.

    Parameters
    ----------
    document : dict
        What it is to say; names of files, as seen from ``origin``, are changed in place.
    origin, path : Path
        The other one, and where to write.
    option : str
        Of the command, that said where.
    head : str
        Lines before all else.

    Raises
    ------
    InvalidInput
        If the file cannot be written.
    """
    _moved(document, origin.parent.resolve(), path.parent.resolve())
    try:
        path.write_text(head + edited(origin.read_text("utf-8"), document | {"name": path.stem}), "utf-8")
    except OSError as error:
        raise InvalidInput(f"{option} must be a writable file, got {path} ({error.strerror})") from None
    return scenes.load(path)


def _moved(document: dict[str, Any], source: Path, target: Path) -> None:
    for table in (document.get("object", {}), *document.get("textures", [])):
        if isinstance(table.get("file"), str):
            table["file"] = os.path.relpath(source / table["file"], target)
    told = document.get("uncertainty", {})
    if isinstance(told.get("covariance"), str):
        told["covariance"] = os.path.relpath(source / told["covariance"], target)
