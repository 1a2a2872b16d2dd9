"""What a dossier's numbers depend on: versions, the processor, and the SHA-256 of all that was read."""

from __future__ import annotations

import hashlib
import json
import platform
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import imaging
import measure
import planner
import render
import scenes
import validation
from scenes import Scene
from scenes.load import find
from validation.batch import machine
from validation.batch.part_files import by_content, digest, digests
from validation.code_digest import digest as code_digest
from validation.versions import PROGRAM, required, version

_HOST = ("system", "cores", "python")  # what does not decide a number, or is told beside


@dataclass(frozen=True)
class InputFile:
    """Something that was read: what it is to the scene, its name, and its SHA-256, "" of what cannot be read."""

    what: str
    name: str
    sha256: str


def versions(variant: str) -> dict[str, str]:
    """Of the program, its code (SHA-256), Python, the renderer's variant and all libraries that the program needs."""
    code = code_digest((scenes, imaging, planner, render, measure, validation), ())
    return {
        PROGRAM: version(), "code (SHA-256)": code.hex(), "python": platform.python_version(),
        "renderer's variant": variant, **{name: version(name) for name in _libraries()},
    }  # fmt: skip


def processor() -> dict[str, str]:
    """What decides the last digits of a number: the processor, and the instruction sets that are taken on it."""
    return {key: str(value) for key, value in machine.here().items() if key not in _HOST}


def host() -> dict[str, str]:
    """What does not: system and cores."""
    return {key: str(value) for key, value in machine.here().items() if key in _HOST}


def files(source: str | Path, scene: Scene) -> tuple[InputFile, ...]:
    """The scene's file, each file that it names, and the whole scene as it was read, all defaults and all that was read
    from other files in it, those of parts and textures as their content."""
    path, document = find(source), scene.model_dump(mode="json", by_alias=True)
    named = [InputFile("part or texture", Path(name).name, sha) for name, sha in digests(document).items()]
    whole = hashlib.sha256(record(scene).encode()).hexdigest()
    return InputFile("scene file", path.name, digest(path)), *named, InputFile("scene as read", "scene.json", whole)


def record(scene: Scene) -> str:
    """The scene as it was read, JSON: the same from every folder."""
    document: dict[str, Any] = scene.model_dump(mode="json", by_alias=True)
    found = by_content({"campaign": document, "files": digests(document)})["campaign"]
    return json.dumps(found, indent=1, sort_keys=True) + "\n"


def _libraries() -> list[str]:
    """Names of what the program needs, without its extras."""
    told = [each for each in required() if "extra ==" not in each]
    return sorted(re.split(r"[\[<>=!~; ]", each)[0] for each in told)
