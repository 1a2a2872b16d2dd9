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
from validation.cost.parameter import Fit, Parameter, slope

_SAMPLES = (1, 4, 16, 64)
_SEEDS = 6
_AVERAGED = (1, 2, 4, 8)
_RENDERS = 32  # of one ray a fine pixel, to be averaged
_NOTE = (
    "Theory: -3/4 for jittered strata that an edge crosses, -1/2 for averages of renders with different seeds. "
    "The blur adds up fine pixels, whose errors are independent."
)


def rays_parameter(cases: Sequence[Case], variant: str) -> Parameter:
    """Scatter of the noise-free image's corners (px) and distance (px) over seeds, against rays a pixel."""
    rows = [*_stratified(cases, variant), *_averages(cases, variant)]
    fits = []
    for label, theory in (("stratified", -0.75), ("renders averaged", -0.5)):
        points = np.array([row[1:4] for row in rows if row[0] == label], float)
        fits.append(Fit(f"{label}: corner error against rays", slope(points[:, 0], points[:, 2]), theory))
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


def _stratified(cases: Sequence[Case], variant: str) -> list[tuple]:
    rows = []
    for quality in qualities(*_SAMPLES):
        began = time.perf_counter()
        stacks = [[_image(case, replace(quality, seed=s), variant) for s in range(_SEEDS)] for case in cases]
        seconds = (time.perf_counter() - began) / (_SEEDS * len(cases))
        rows.append(("stratified", rays(quality), seconds, *_scatter(cases, [np.array(s) for s in stacks])))
    return rows


def _averages(cases: Sequence[Case], variant: str) -> list[tuple]:
    quality = qualities(1)[0]
    began = time.perf_counter()
    stacks = [
        np.array([_image(case, replace(quality, seed=100 + s), variant) for s in range(_RENDERS)]) for case in cases
    ]
    seconds = (time.perf_counter() - began) / (_RENDERS * len(cases))
    rows = []
    for count in _AVERAGED:
        means = [stack.reshape(-1, count, *stack.shape[1:]).mean(1) for stack in stacks]
        rows.append(("renders averaged", count * rays(quality), count * seconds, *_scatter(cases, means)))
    return rows


def _image(case: Case, quality: render.Quality, variant: str) -> np.ndarray:
    return render.image(case.scene, case.setting.sensor, case.setting.light, quality, variant)


def _scatter(cases: Sequence[Case], stacks: Sequence[np.ndarray]) -> tuple[float, float, float]:
    """Root mean square over settings of the sigma over images of a corner coordinate, the distance, and over noise."""
    corners, distances, relative = [], [], []
    for case, stack in zip(cases, stacks, strict=True):
        found = measure.distance(stack, case.scene, case.setting.sensor)
        corners.append(found.corners.var(0, ddof=1).mean())
        distances.append(found.value_px.var(ddof=1))
        relative.append(distances[-1] / found.variance_px2.mean())
    return tuple(float(np.sqrt(np.mean(values))) for values in (corners, distances, relative))
