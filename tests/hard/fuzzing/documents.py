"""Campaigns, lenses and results, corrupted."""

from __future__ import annotations

import copy
import functools
import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np

import measure
from scenes import InvalidInput
from tests.hard.fuzzing.mutations import keys, spoilt, stored
from validation import comparison as comparing
from validation.batch import campaign as campaigns

_CAMPAIGN = """\
name = "night"
title = "a night's work"
scenes = ["task1"]
[grid]
sensor_polar = [20, 40]
sensor_azimuth = {from = 0, to = 270, step = 90}
light_polar = {from = 10, to = 30, count = 3}
light_azimuth = [0]
[sweep]
noise.sigma = [1.2, 2.4]
camera.exposure = {from = 100, to = 200, count = 2}
"""
_LENS = """\
fx = 150.0
fy = 151.0
cx = 40.0
cy = 30.0
distortion = [-0.2, 0.01, 0.0, 0.0, 0.0]
"""
_RANGES = (
    "{from = 0, to = inf, step = 1}", "{from = 0, to = 1e8, step = 1}", "{from = 0, to = 1, step = 0}",
    "{from = 0, to = 1, count = 1e18}", "{from = 1, to = 70, count = 178}", "{from = 5, to = 0, step = 1}",
    "{from = nan, to = 1, count = 2}", "{from = 0, to = 1, step = 5e-324}", '{from = "a", to = 1, count = 2}', "[200]",
    '["a", "=b"]', "[{}, []]",
)  # fmt: skip
_VALUES: tuple[Any, ...] = (
    None, True, "", "x", "=1", -1, 0, 1e308, -1e308, math.nan, math.inf, 10**30, [], [1], {}, {"a": 1}, [[]],
    "\0", 1e-320,
)  # fmt: skip


def campaign(rng: np.random.Generator, folder: Path) -> str:
    """A campaign with one to three lines corrupted; what can be loaded gives its first and last settings."""
    data = _CAMPAIGN.encode()
    for _ in range(rng.integers(1, 4)):
        data = keys(rng, data, _RANGES) if rng.random() < 0.5 else rng.choice([keys, spoilt])(rng, data)
    loaded = campaigns.load(stored(folder, "campaign.toml", data))
    for index in {0, len(loaded) // 2, len(loaded) - 1}:
        try:
            loaded.case(index)
        except InvalidInput as error:
            if "\n" in str(error):
                raise AssertionError(str(error)) from None
    return "loaded"


def lens(rng: np.random.Generator, folder: Path) -> str:
    """A lens with one to three lines corrupted, or far from a lens; what can be loaded measures a photograph."""
    data = _LENS.encode()
    for _ in range(rng.integers(1, 4)):
        data = rng.choice([keys, keys, spoilt])(rng, data)
    if rng.random() < 0.3:
        bends = ", ".join(f"{k:.3g}" for k in rng.normal(0, 10.0 ** rng.uniform(-2, 2), rng.integers(0, 6)))
        numbers = 10.0 ** rng.uniform(-2, 5, 2), rng.normal((40, 30), 10.0 ** rng.uniform(0, 4))
        (fx, fy), (cx, cy) = numbers
        data = f"fx = {fx}\nfy = {fy}\ncx = {cx}\ncy = {cy}\ndistortion = [{bends}]".encode()
    loaded = measure.load_lens(stored(folder, "lens.toml", data))
    points = np.array([[10.0, 20.0], [128.0, 120.0]])
    loaded.straighten(loaded.distort(points))
    return measure.measure_quadrilateral(_photograph(), lens=loaded).status


@functools.cache
def _photograph() -> np.ndarray:
    """A quadrilateral of 40 x 26 px, turned a little."""
    corners = np.array([[18, 15], [58, 20], [54, 46], [15, 42]])
    sharp = cv2.fillConvexPoly(np.full((60, 80), 20.0), corners, 180.0)
    return cv2.GaussianBlur(sharp, None, 0.8) + np.random.default_rng(1).standard_normal(sharp.shape)


def comparison(rng: np.random.Generator, folder: Path, run: Path) -> str:
    """A result compared with itself after some of its values were changed, or its bytes."""
    text = (run / "result.json").read_text(encoding="utf-8")
    document = json.loads(text)
    for _ in range(rng.integers(1, 3)):
        document = changed(rng, document)
    data = spoilt(rng, text.encode()) if rng.random() < 0.3 else json.dumps(document).encode()
    before, after = comparing.read(run), comparing.read(stored(folder, "result.json", data))
    json.dumps(comparing.compare(before, after).to_json(), allow_nan=False)
    return "compared"


def changed(rng: np.random.Generator, document: Any) -> Any:
    """A JSON document with one value anywhere in it replaced, removed or doubled."""
    whole = copy.deepcopy(document)
    at = whole
    while True:
        places = list(at) if isinstance(at, dict) else list(range(len(at)))
        if not places:
            return whole
        place = places[rng.integers(len(places))]
        if isinstance(at[place], dict | list) and at[place] and rng.random() < 0.85:
            at = at[place]
            continue
        what = rng.integers(4)
        if what == 0:
            del at[place]
        elif what == 1 and isinstance(at, list):
            at.append(at[place])
        else:
            at[place] = _VALUES[rng.integers(len(_VALUES))]
        return whole
