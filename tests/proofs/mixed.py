"""Photographs with several things wrong at once, drawn at random: those that are ok are right."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

import cv2
import numpy as np
import typer

from scenes.cameras import tone
from scenes.photograph import Photograph
from tests.oracle import polygon_image
from tests.proofs.processed import jpeg, judged, resized, rounded, sharpened, smoothed

_SHAPE = (180, 220)
_MIDDLE = np.array([110.0, 90.0])
_TONES = {"linear": 0.55, "linear, unmarked": 0.15, "sRGB, unmarked": 0.15, "sRGB, undone": 0.15}


@dataclass(frozen=True)
class Taken:
    """How a photograph was taken and what was done with it; 0 (1 for ``resize``) where nothing was.

    Corners (4, 2), px; contrast, background and noise, grey levels of light; blur, px; gain of the shot noise; loss of
    light in the image's corners; a key of ``_TONES``; factor and OpenCV's number of the interpolation; amount, px and
    quality.
    """

    corners: np.ndarray
    contrast: float
    background: float
    noise: float
    blur: float
    gain: float
    vignette: float
    tone: str
    resize: float
    how: int
    sharpened: float
    smoothed: float
    jpeg: int

    def __str__(self) -> str:
        told = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "corners"}
        return " ".join(f"{k}={v if isinstance(v, str) else round(float(v), 2)}" for k, v in told.items() if v)


def taken(rng: np.random.Generator) -> Taken:
    """One at random: contrast over noise from 5 to 120, more than half of them changed in some way."""
    angle, size = rng.uniform(0, 2 * np.pi), rng.uniform([60, 50], [110, 90])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    box = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 * size + rng.uniform(-9, 9, (4, 2))
    noise, background = float(np.exp(rng.uniform(np.log(0.4), np.log(8)))), rng.uniform(15, 90)
    contrast = float(np.clip(noise * np.exp(rng.uniform(np.log(5), np.log(120))), 4, 235 - background))
    if rng.random() < 0.3:
        background, contrast = background + contrast, -contrast

    def sometimes(share: float, low: float, high: float) -> float:
        value = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        return value if rng.random() < share else 0.0

    return Taken(
        box @ turn + _MIDDLE + rng.uniform(-8, 8, 2), contrast, background, noise, rng.uniform(0.4, 1.5),
        sometimes(0.3, 0.02, 0.3), sometimes(0.3, 0.05, 0.4), str(rng.choice(list(_TONES), p=list(_TONES.values()))),
        float(rng.choice([1, 0.5, 2, 0.8], p=[0.82, 0.08, 0.05, 0.05])),
        int(rng.choice([cv2.INTER_AREA, cv2.INTER_LINEAR, cv2.INTER_CUBIC])), sometimes(0.2, 0.05, 1.0),
        sometimes(0.1, 0.25, 0.8), int(rng.choice([0, 50, 75, 90, 95, 98, 100], p=[0.82] + 6 * [0.03])),
    )  # fmt: skip


def shots_of(one: Taken, rng: np.random.Generator):
    """Re-shots: photographs and their true corners."""
    y, x = np.mgrid[: _SHAPE[0], : _SHAPE[1]]
    away = ((x - _MIDDLE[0]) ** 2 + (y - _MIDDLE[1]) ** 2) / (_MIDDLE**2).sum()
    clean = one.background + one.contrast / 100 * polygon_image(one.corners, _SHAPE, one.blur)
    clean = clean * (1 - one.vignette * away)
    corners = one.resize * (one.corners + 0.5) - 0.5

    def shot():
        light = clean + np.sqrt(one.noise**2 + one.gain * clean) * rng.standard_normal(_SHAPE)
        image = rounded(255 * _srgb(light / 255) if one.tone.startswith("sRGB") else light)
        image = image if one.resize == 1 else resized(one.resize, one.how, image)
        image = sharpened(one.sharpened, image) if one.sharpened else image
        image = smoothed(one.smoothed, image) if one.smoothed else image
        image = jpeg(one.jpeg, image) if one.jpeg else image
        if one.tone.endswith("undone"):
            image = 255 * tone.SRGB.light(image / 255)
        return Photograph(image, 255.0, tone_known=not one.tone.endswith("unmarked")), corners

    return shot


def _srgb(light: np.ndarray) -> np.ndarray:
    light = np.clip(light, 1e-9, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def mixed(
    photographs: Annotated[int, typer.Option(help="Random photographs.")] = 60,
    count: Annotated[int, typer.Option(help="Shots of each; 12 where none is ok.")] = 20,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Random photographs, each shot anew; those that are ok without being right are listed, with exit status 1."""
    wrong, ok = [], 0
    for number in range(photographs):
        rng = np.random.default_rng([seed, number])
        one = taken(rng)
        found = judged(shots_of(one, rng), count)
        ok += found.statuses["ok"] > 0
        line = f"{number:3d} scatter {found.scatter:.2f} bias {found.bias:.2f} {dict(found.statuses)} {one}"
        print(line, flush=True)
        wrong += [] if found.honest else [line]
    print(
        f"{photographs} photographs, {ok} of them ok at least once; ok without being right: {len(wrong)}",
        *wrong,
        sep="\n",
    )
    raise typer.Exit(1 if wrong else 0)
