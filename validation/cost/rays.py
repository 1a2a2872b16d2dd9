"""Rays a pixel: how far the clean image's corners and distance are off, and how long a render takes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import measure
import render
from validation.batch.campaign import Case
from validation.cost.model import qualities, rays
from validation.cost.parameter import Parameter, Trend, slope
from validation.cost.watch import Watch

_SAMPLES = (1, 4, 16, 64)
_SEEDS = 6  # at most
_AVERAGED = (1, 2, 4, 8)
_RENDERS = 32  # at most, of one ray a fine pixel, to be averaged
_NOTE = (
    "Theory: -3/4 for jittered strata that an edge crosses, -1/2 for averages of renders with different seeds. "
    "The blur adds up fine pixels, whose errors are independent."
)


def rays_parameter(cases: Sequence[Case], variant: str, watch: Watch = Watch()) -> Parameter:
    """Scatter of the noise-free image's corners (px) and distance (px) over seeds, against rays a pixel."""
    rows = _stratified(cases, variant, Watch(watch.left / 2, watch.tell)) + _averages(cases, variant, watch)
    fits = []
    for label, theory in (("stratified", -0.75), ("renders averaged", -0.5)):
        points = np.array([row[1:4] for row in rows if row[0] == label], float)
        fits.append(Trend(f"{label}: corner error against rays", slope(points[:, 0], points[:, 2]), theory))
    return Parameter(
        name="rays",
        title="Rays a pixel at an edge: error of the noise-free image",
        columns=("sampler", "rays", "seconds", "corner px", "distance px", "distance / noise"),
        rows=tuple(rows),
        x="rays",
        y="corner px",
        series="sampler",
        fits=tuple(fits),
        note=_NOTE,
    )


def _stratified(cases: Sequence[Case], variant: str, watch: Watch) -> list[tuple]:
    """One row a quality: images of different seeds, each measured."""
    rows = []
    for quality in qualities(*_SAMPLES):
        part = Watch(watch.left / len(_SAMPLES), watch.tell)
        began, found = time.perf_counter(), []
        for s in part.samples(_SEEDS, least=3):
            found.append([_measured(case, _image(case, replace(quality, seed=s), variant)) for case in cases])
        seconds = (time.perf_counter() - began) / (len(found) * len(cases))
        rows.append(("stratified", rays(quality), seconds, *_scatter(found)))
    return rows


def _averages(cases: Sequence[Case], variant: str, watch: Watch) -> list[tuple]:
    """One row a number of renders that are averaged; of each number at least two averages."""
    quality, most = qualities(1)[0], max(_AVERAGED)
    began, groups = time.perf_counter(), {count: [] for count in _AVERAGED}
    for block in watch.samples(_RENDERS // most, least=2):
        first = 100 + most * block
        images = [[_image(case, replace(quality, seed=first + s), variant) for s in range(most)] for case in cases]
        for count, found in groups.items():
            for at in range(0, most, count):
                means = [np.mean(shown[at : at + count], 0) for shown in images]
                found.append([_measured(*pair) for pair in zip(cases, means, strict=True)])
    seconds = (time.perf_counter() - began) / (len(groups[1]) * len(cases))
    return [
        ("renders averaged", count * rays(quality), count * seconds, *_scatter(found))
        for count, found in groups.items()
    ]


def _image(case: Case, quality: render.Quality, variant: str) -> np.ndarray:
    return render.image(case.scene, case.setting.sensor, case.setting.light, quality, variant)


def _measured(case: Case, image: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Corners px, distance px and its variance px^2 of a noise-free image."""
    found = measure.distance(image, case.scene, case.setting.sensor)
    return found.corners, float(found.value_px), float(found.variance_px2)


def _scatter(found: Sequence[Sequence[tuple]]) -> tuple[float, float, float]:
    """Root mean square over settings of the sigma over images of a corner coordinate, the distance, and over noise.

    ``found`` holds what `_measured` says of each image and setting.
    """
    corners, distances, relative = [], [], []
    for case in zip(*found, strict=True):
        places, values, variances = (np.array(each) for each in zip(*case, strict=True))
        corners.append(places.var(0, ddof=1).mean())
        distances.append(values.var(ddof=1))
        relative.append(distances[-1] / variances.mean())
    return tuple(float(np.sqrt(np.mean(values))) for values in (corners, distances, relative))
