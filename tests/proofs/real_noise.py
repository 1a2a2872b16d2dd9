"""``ICE_DATA=DIR python -m tests.proofs real-noise``: are predicted variances true under the noise of a real sensor?

DIR holds reference sets of EMVA 1288 (github: EMVA1288/datasets; CC BY-SA, so not in this repository): frames of real
cameras, evenly lit, in pairs of each exposure. Half of the steps tell the camera's noise by photon transfer, as EMVA
1288 has it. Differences of the other half's pairs over sqrt(2) are real noise of their levels, with all its
correlation, outliers and patterns that change from frame to frame: put onto a noise-free render, level by level, they
take the place of the drawn noise. Measured over predicted variance tells whether the model is true. Without DIR
nothing is done, and the exit status is 0.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated
from unittest import mock

import cv2
import numpy as np
import typer
from scipy import stats

import measure
import render
import scenes
from scenes import Noise, Picture
from validation.remeasured import Method, Sample, remeasured

DESCRIPTION = "EMVA1288_Data.txt"
_OF_SCALE = 0.55  # of what is left above darkness: where the brightest face of the scene lies
_ESTIMATORS = ("gradient", "arrangement")
_AT_ONCE = 50


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of frames of equal light: ``bits``, and of each step mean level (k,), of the dark pair beside it, variances
    of single pixels by the pairs' differences (k,), and the fields of noise (k, height, width), float32."""

    bits: int
    level: np.ndarray
    dark: np.ndarray
    variance: np.ndarray
    dark_variance: np.ndarray
    fields: np.ndarray
    dark_fields: np.ndarray

    @property
    def used(self) -> np.ndarray:
        """Steps up to 70 % of saturation, which is where the variance is greatest."""
        return self.level - self.dark <= 0.7 * (self.level - self.dark)[np.argmax(self.variance)]

    def noise(self, which: np.ndarray) -> Noise:
        """The camera's noise by some steps: slope of the photon transfer through the origin, dark noise, dark level."""
        signal, extra = (self.level - self.dark)[which], (self.variance - self.dark_variance)[which]
        dark = float(self.dark_variance[which].mean())
        return Noise(
            sigma=float(np.sqrt(max(dark - 1 / 12, 1e-6))), gain=float(signal @ extra / (signal @ signal)),
            dark_level=float(self.dark[which].mean()), bits=self.bits,
        )  # fmt: skip


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
    lit, dark = ([_pair(taken[kind, exposure]) for exposure in steps] for kind in ("b", "d"))
    columns = [np.array(each) for found in (lit, dark) for each in zip(*found, strict=True)]
    level, variance, fields, dark_level, dark_variance, dark_fields = columns
    return Pairs(bits, level, dark_level, variance, dark_variance, fields, dark_fields)


def _pair(files: list[Path]) -> tuple[float, float, np.ndarray]:
    """Mean level, variance of a pixel, and field of noise of two frames."""
    first, second = (cv2.imread(str(file), cv2.IMREAD_UNCHANGED).astype(np.float32) for file in files)
    field = (first - second - (first - second).mean()) / np.float32(np.sqrt(2))
    return float((first.mean() + second.mean()) / 2), float((field.astype(float) ** 2).mean()), field


def told_of(field: np.ndarray) -> dict[str, float]:
    """How far a field is from independent normal noise: correlation of neighbours along rows and columns, variance of
    rows' and columns' means over what independent pixels have, and part of the pixels beyond 5 sigma."""
    unit = (field - field.mean()) / field.std()
    height, width = unit.shape
    return {
        "along rows": float((unit[:, 1:] * unit[:, :-1]).mean()), "along columns": float((unit[1:] * unit[:-1]).mean()),
        "rows": float(unit.mean(1).var(ddof=1) * width), "columns": float(unit.mean(0).var(ddof=1) * height),
        "beyond 5 sigma": float((np.abs(unit) > 5).mean()),
    }  # fmt: skip


def noisy(image: np.ndarray, pairs: Pairs, which: np.ndarray, noise: Noise, rng: np.random.Generator) -> np.ndarray:
    """A noise-free image with real noise: of each pixel that of the step whose level is nearest, from one random place
    of the frames, scaled by the root of the noise model's variances of both levels."""
    levels = np.concatenate([[pairs.dark[which].mean()], pairs.level[which]])
    fields = [pairs.dark_fields[which], *pairs.fields[which][:, None]]
    nearest = np.abs(image[..., None] - levels).argmin(-1)
    height, width = image.shape
    made = np.array(image)
    for step in np.unique(nearest):
        some = fields[step]
        field = some[rng.integers(len(some))]
        top, left = (int(rng.integers(there - here + 1)) for there, here in zip(field.shape, image.shape, strict=True))
        here = nearest == step
        scale = np.sqrt(_variance(noise, image[here]) / _variance(noise, levels[step]))
        made[here] += scale * field[top : top + height, left : left + width][here]
    return made


def _variance(noise: Noise, level: np.ndarray) -> np.ndarray:
    return noise.variance + noise.gain * np.maximum(level - noise.dark_level, 0.0)


def picture(noise: Noise, setting: int = 0, name: str = "task1") -> Picture:
    """A bundled scene before the camera that has this noise, half bright."""
    scene = scenes.load(name)
    there = scene.settings[setting]
    scene = scene.with_(
        noise=noise.model_dump(), camera={"exposure": _OF_SCALE * (2**noise.bits - 1 - noise.dark_level)}
    )
    return Picture.of(scene, there.sensor, there.light)


def compared(pairs: Pairs, count: int, seed: int, setting: int = 0, estimators: tuple[str, ...] = _ESTIMATORS) -> dict:
    """Measured over predicted variance by estimator, with its 95 % interval, of so many pictures with real noise."""
    steps = np.flatnonzero(pairs.used)
    noise, rng = pairs.noise(steps[0::2]), np.random.default_rng(seed)
    shown = picture(noise, setting)
    image = render.image(shown)
    pictures = np.array([noisy(image, pairs, steps[1::2], noise, rng) for _ in range(count)])
    rows = {}
    for name in estimators:
        told = measure.propagate(image, shown, estimator=name).measurands
        batches = (pictures[i : i + _AT_ONCE] for i in range(0, count, _AT_ONCE))
        (found,) = remeasured(shown, batches, (Method(name),))
        sample, predicted = Sample.of(found.object[:, 0]), float(told.covariance[0, 0])
        rows[name] = {
            "ratio": sample.ratio(predicted), "interval": sample.interval(predicted), "n": sample.n,
            "failed": sample.failed, "status": told.status[0],
            "correlated": int((found.status[:, 0] == "correlated").sum()),
        }  # fmt: skip
    return {"noise": noise.model_dump(include={"sigma", "gain", "dark_level", "bits"}),
            "fields": told_of(pairs.fields[steps[1::2]][-1]), "dark field": told_of(pairs.dark_fields[steps[1]]),
            "estimators": rows}  # fmt: skip


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
    settings: Annotated[str, typer.Option(help="Of task1, by number from 0.")] = "0,5",
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Variances of pictures with the noise of real cameras (reference sets below ICE_DATA), 3 minutes a set."""
    root = os.environ.get("ICE_DATA", "")
    folders = sorted(file.parent for file in Path(root).rglob(DESCRIPTION)) if root else []
    if not folders:
        print("ICE_DATA names no folder with reference sets of EMVA 1288 (github: EMVA1288/datasets): nothing done.")
        raise typer.Exit
    ratios = []
    for folder in folders:
        pairs = read(folder)
        found = {number: compared(pairs, count, seed, int(number)) for number in settings.split(",")}
        print(json.dumps({"set": folder.name, "package emva1288": by_package(folder), "settings": found}, indent=1))
        ratios += [(row["ratio"], row["n"] - row["failed"]) for each in found.values()
                   for row in each["estimators"].values() if row["status"] == "ok"]  # fmt: skip
    p = min(2 * min(stats.chi2.cdf(r * (n - 1), n - 1), stats.chi2.sf(r * (n - 1), n - 1)) for r, n in ratios)
    print(f"{len(ratios)} variances: ratios {min(ratios)[0]:.3f} to {max(ratios)[0]:.3f}, smallest p-value {p:.2g}")
    raise typer.Exit(0 if p > 1 - (1 - 0.01) ** (1 / len(ratios)) else 1)
