"""``ICE_DATA=DIR python -m tests.proofs real-noise``: are predicted variances true under the noise of real sensors?

DIR holds reference sets of EMVA 1288 (github: EMVA1288/datasets; CC BY-SA, so not in this repository): frames of real
cameras, evenly lit, in pairs of each exposure. Half of the steps tell the camera's noise by photon transfer
(`measure.photon_transfer`; where variances do not lie on a line, with their excess). Differences of the other half's
pairs over sqrt(2) are real noise of their levels, with its outliers, correlation and patterns that change from frame to
frame: put onto noise-free renders, level by level, they take the place of the drawn noise, for every estimator and all
measurands of three scenes. What rows and columns share has one value on both sides of an edge, so it is taken from the
dark frames. Without DIR nothing is done, and the exit status is 0.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated
from unittest import mock

import cv2
import numpy as np
import typer

import measure
import render
import scenes
from imaging.features.measurand import measurands
from imaging.pictures import Pictures
from measure import ESTIMATORS, FramePair, PhotonTransfer, photon_transfer
from scenes import Noise, Picture, Scene
from scenes.status import is_trusted
from tests import toleranced
from tests.proofs.kinds import Row, summed_up, told
from validation.remeasured import Method, batches
from validation.simulation import simulated

DESCRIPTION = "EMVA1288_Data.txt"
_OF_SCALE = 0.55  # of what is left above darkness: where the brightest face of the scene lies
_AT_ONCE = 25
_RENDER = 1000  # the render that is measured; those that tell biases are from 0


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of frames of equal light: ``bits``, of each step what its pairs tell, and the fields of noise
    (k, height, width), float32, without what their rows and columns share; that is ``rows`` (k, height) and ``columns``
    (k, width) of the dark ones."""

    bits: int
    lit: list[FramePair]
    dark: list[FramePair]
    fields: np.ndarray
    dark_fields: np.ndarray
    rows: np.ndarray
    columns: np.ndarray

    @property
    def signal(self) -> np.ndarray:
        """Mean level above darkness of each step (k,)."""
        return np.array([lit.level - dark.level for lit, dark in zip(self.lit, self.dark, strict=True)])

    @property
    def used(self) -> np.ndarray:
        """Steps up to 70 % of saturation, which is where the variance is greatest."""
        return self.signal <= 0.7 * self.signal[np.argmax([pair.variance for pair in self.lit])]

    @property
    def halves(self) -> tuple[PhotonTransfer, np.ndarray]:
        """The camera's noise by every other step, and those of the others whose noise is used."""
        used = np.flatnonzero(self.used)
        return photon_transfer(self.lit[0::2], self.dark[0::2], self.bits), used[used % 2 == 1]


def read(folder: Path) -> Pairs:
    """Pairs of a reference set, by its description; stacks for the spatial part are left out."""
    taken, bits, key = {}, 8, ""
    for line in (folder / DESCRIPTION).read_text(errors="replace").splitlines():
        kind, *rest = line.split() or [""]
        if kind == "n":
            bits = int(rest[0])
        elif kind in ("b", "d"):
            key = (kind, float(rest[0]))
            taken.setdefault(key, [])
        elif kind == "i":
            taken[key].append(folder / rest[0].replace("\\", "/"))
    steps = sorted(exposure for kind, exposure in taken if kind == "b" and len(taken[kind, exposure]) == 2)
    (lit, fields, *_), (dark, dark_fields, rows, columns) = (
        zip(*(_pair(taken[kind, exposure]) for exposure in steps), strict=True) for kind in ("b", "d")
    )
    return Pairs(bits, list(lit), list(dark), *map(np.array, (fields, dark_fields, rows, columns)))


def _pair(files: list[Path]) -> tuple[FramePair, np.ndarray, np.ndarray, np.ndarray]:
    """What two frames tell, their noise alone, and what its rows and its columns share."""
    first, second = (cv2.imread(str(file), cv2.IMREAD_UNCHANGED).astype(np.float32) for file in files)
    field = (first - second - (first - second).mean()) / np.float32(np.sqrt(2))
    rows, columns = field.mean(1), field.mean(0)
    return FramePair.of(first, second), field - rows[:, None] - columns, rows, columns


def told_of(field: np.ndarray) -> dict[str, float]:
    """How far a field is from independent normal noise: correlation of neighbours along rows and columns, and part of
    the pixels beyond 5 sigma (5.7e-7 of normal ones)."""
    unit = (field - field.mean()) / max(float(field.std()), 1e-12)
    return {
        "along rows": float((unit[:, 1:] * unit[:, :-1]).mean()),
        "along columns": float((unit[1:] * unit[:-1]).mean()),
        "beyond 5 sigma": float((np.abs(unit) > 5).mean()),
    }


def noisy(image: np.ndarray, pairs: Pairs, which: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A noise-free image with real noise: of each pixel that of the step whose level is nearest, from one random place
    of the frames, scaled to the variance between the steps; of rows and columns that of one dark pair."""
    levels = np.array([pairs.dark[which[0]].level, *(pairs.lit[k].level for k in which)])
    variances = np.array([np.mean([pairs.dark[k].variance for k in which]), *(pairs.lit[k].variance for k in which)])
    fields = [pairs.dark_fields[which], *pairs.fields[which][:, None]]
    nearest = np.abs(image[..., None] - levels).argmin(-1)
    made = np.array(image)
    for step in np.unique(nearest):
        some = fields[step]
        here = nearest == step
        scale = np.sqrt(np.interp(image[here], levels, variances) / variances[step])
        made[here] += scale * _part(some[rng.integers(len(some))], image.shape, rng)[here]
    one = which[rng.integers(len(which))]
    shared = (
        _part(lines[one], (size,), rng) for lines, size in zip((pairs.rows, pairs.columns), image.shape, strict=True)
    )
    rows, columns = shared
    return made + rows[:, None] + columns


def _part(field: np.ndarray, shape: tuple[int, ...], rng: np.random.Generator) -> np.ndarray:
    """A random part of a field that has such a shape."""
    first = [int(rng.integers(there - here + 1)) for there, here in zip(field.shape, shape, strict=True)]
    return field[tuple(slice(at, at + size) for at, size in zip(first, shape, strict=True))]


def pictures(noise: Noise, folder: Path) -> Iterator[tuple[str, tuple[str, ...], Picture]]:
    """Settings of three scenes before a camera that has this noise, half bright, and the estimators that see them: a
    block, a plate of five requirements, and one with all kinds of features between others."""
    not_plain = tuple(each for each in ESTIMATORS if each != "arrangement")
    for name, numbers, names in (("task1", (0, 5), tuple(ESTIMATORS)), ("plate", (0, 2), not_plain)):
        scene = scenes.load(name)
        for number in numbers:
            there = scene.settings[number]
            yield f"{name} {number}", names, Picture.of(before(scene, noise), there.sensor, there.light)
    scene = toleranced.scene(folder, width=620, height=440, focal_px=2200.0)
    yield "toleranced", ("gradient",), Picture.of(before(scene, noise), (15, 260), (25, 300))


def before(scene: Scene, noise: Noise) -> Scene:
    """A scene before the camera that has this noise, exposed to half of its scale."""
    full = 2**noise.bits - 1 - noise.dark_level
    return scene.with_(noise=noise.model_dump(exclude_none=True), camera={"exposure": _OF_SCALE * full})


def compared(
    picture: Picture, pairs: Pairs, which: np.ndarray, count: int, seed: int, estimators: tuple[str, ...]
) -> list[Row]:
    """All measurands of a picture by each estimator, in so many pictures with real noise, biases taken off."""
    rows = []
    for locator in estimators:
        shown, rng, method = _for(picture, locator), np.random.default_rng(seed), Method(locator)
        clean = render.image(shown, quality=render.Quality(seed=_RENDER, everywhere=not ESTIMATORS[locator].local))
        off = simulated(shown, method)
        parts = [
            measure.measure(np.array([noisy(clean, pairs, which, rng) for _ in range(k)]), shown, None, None, locator,
                            correction=off)
            for k in batches(count, _AT_ONCE)
        ]  # fmt: skip
        found = replace(parts[0], value=np.concatenate([part.value for part in parts]),
                        status=np.concatenate([part.status for part in parts]))  # fmt: skip
        true = measurands(Pictures.of(shown)).value_object
        rows += [replace(row, name=f"{locator}: {row.name}") for row in told(shown, found, true, off)]
    return rows


def _for(picture: Picture, locator: str) -> Picture:
    """``strip`` and ``arrangement`` take all noise for that of single pixels."""
    scene = picture.scene
    if locator not in ("strip", "arrangement"):
        return picture
    white = {**scene.noise.model_dump(exclude_none=True), "row_sigma": 0.0, "column_sigma": 0.0}
    return Picture.of(scene.with_(noise=white), picture.sensor, picture.lights)


def by_package(folder: Path) -> dict[str, float] | None:
    """Gain and dark noise by the reference implementation; None where it is not installed."""
    if find_spec("emva1288") is None:
        return None
    from emva1288.process.data import Data1288
    from emva1288.process.loader import LoadImageData
    from emva1288.process.parser import ParseEmvaDescriptorFile
    from emva1288.process.results import Results1288

    told = ParseEmvaDescriptorFile(str(folder / DESCRIPTION))

    def load(name: str) -> np.ndarray:
        return cv2.imread(name, cv2.IMREAD_UNCHANGED)

    with mock.patch.object(np, "asfarray", lambda values: np.asarray(values, float), create=True):
        found = Results1288(Data1288(LoadImageData(told.images, fload=load).data).data)
        return {"K": float(found.K), "sigma_y_dark": float(found.sigma_y_dark)}


def real_noise(
    count: Annotated[int, typer.Option(help="Pictures a setting.")] = 400,
    seed: Annotated[int, typer.Option()] = 1,
    only: Annotated[str, typer.Option(help="Sets whose names have this in them.")] = "",
    rows: Annotated[bool, typer.Option(help="Let the model know what rows and columns share.")] = True,
) -> None:
    """Variances of pictures with the noise of real cameras (reference sets below ICE_DATA), 20 minutes a set."""
    root = os.environ.get("ICE_DATA", "")
    folders = sorted(file.parent for file in Path(root).rglob(DESCRIPTION) if only in file.parent.name) if root else []
    if not folders:
        print("ICE_DATA names no folder with reference sets of EMVA 1288 (github: EMVA1288/datasets): nothing done.")
        raise typer.Exit
    good = True
    for folder in folders:
        pairs = read(folder)
        camera, real = pairs.halves
        noise = camera.noise if is_trusted(camera.status) else camera.followed
        noise = noise if rows else noise.model_copy(update={"row_sigma": 0.0, "column_sigma": 0.0})
        print(json.dumps({
            "set": folder.name, "photon transfer": camera.status, "bend": camera.bend,
            "package emva1288": by_package(folder),
            "noise": noise.model_dump(exclude_none=True), "bright": told_of(pairs.fields[real[-1]]),
            "dark": told_of(pairs.dark_fields[real[0]]),
        }), flush=True)  # fmt: skip
        found: list[Row] = []
        with tempfile.TemporaryDirectory() as there:
            for name, names, picture in pictures(noise, Path(there)):
                new = compared(picture, pairs, real, count, seed, names)
                print(name, *new, sep="\n", flush=True)
                found += new
        good &= summed_up(found)
    raise typer.Exit(0 if good else 1)
