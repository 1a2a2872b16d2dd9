"""Every way in: files, run directories, results, the command line, arrays, the page of `ice explore`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

import scenes
import validation
from scenes.load import BUNDLED
from tests.hard.fuzzing import arrays, commands, directories, documents, exploring, files, uncertainties
from tests.hard.fuzzing import library as libraries


@dataclass
class Room:
    """A folder for hostile files, and a small finished run to be damaged, made when it is first asked for."""

    folder: Path

    @cached_property
    def scene(self) -> Path:
        """Task1 with one setting and a camera of 64 x 60 px."""
        head, _, settings = (BUNDLED / "task1.toml").read_text().partition("[[settings]]")
        for large, small in (("= 256", "= 64"), ("= 240", "= 60"), ("= 800.0", "= 200.0"), ('["task1_part1"]', "[]")):
            head = head.replace(large, small)
        path = self.folder / "small.toml"
        path.write_text(head + "[[settings]]" + settings.split("[[settings]]")[4])
        return path

    @cached_property
    def run(self) -> Path:
        """Its run directory, with result.json."""
        from validation.report import export

        out = self.folder / "run"
        found = validation.run(scenes.load(self.scene), renders=20, seed=1, out=out, workers=1)
        export.write_json(found, out / "result.json")
        return out


def scene(rng: np.random.Generator, room: Room) -> str:
    return files.scene(rng, room.folder)


def mesh(rng: np.random.Generator, room: Room) -> str:
    return files.mesh(rng, room.folder)


def image(rng: np.random.Generator, room: Room) -> str:
    return files.image(rng, room.folder)


def campaign(rng: np.random.Generator, room: Room) -> str:
    return documents.campaign(rng, room.folder)


def lens(rng: np.random.Generator, room: Room) -> str:
    return documents.lens(rng, room.folder)


def comparison(rng: np.random.Generator, room: Room) -> str:
    return documents.comparison(rng, room.folder, room.run)


def directory(rng: np.random.Generator, room: Room) -> str:
    return directories.directory(rng, room.folder, room.run)


def command(rng: np.random.Generator, room: Room) -> str:
    return commands.command(rng, room.folder, room.scene, room.run)


def array(rng: np.random.Generator, _room: Room) -> str:
    return arrays.array(rng)


def uncertain(rng: np.random.Generator, room: Room) -> str:
    return uncertainties.uncertain(rng, room.folder)


def message(rng: np.random.Generator, room: Room) -> str:
    return exploring.message(rng, room.folder)


def library(rng: np.random.Generator, _room: Room) -> str:
    return libraries.library(rng)


_USUAL = (scene, mesh, image, campaign, lens, comparison, directory, command, array)
DOORS = (*_USUAL, array, *_USUAL, uncertain, message, library)
