"""Noisy images a setting: how far an empirical variance is off, and how wide its interval."""

from __future__ import annotations

import time

import numpy as np

import measure
import render
from scenes import InvalidInput
from validation.batch.campaign import Case
from validation.cost.interval import half_width
from validation.cost.parameter import Parameter, Trend, slope
from validation.cost.watch import Watch, at_once

_COUNTS = (10, 20, 40, 80, 160, 320)
_IMAGES = 6400  # at most
_FEWEST = 800
_GROUPS = 10  # of images, the fewest whose variances are compared


def images_parameter(case: Case, image: np.ndarray, seed: int, watch: Watch = Watch()) -> Parameter:
    """Relative scatter of the variance of n distances, from disjoint groups of images of one setting.

    Raises
    ------
    InvalidInput
        If too many images cannot be measured.
    """
    scene, sensor = case.scene, case.setting.sensor
    where, rng = measure.region_of_interest(scene, sensor), np.random.default_rng(seed)
    began, parts, size = time.perf_counter(), [], at_once(image.size, 50)
    for _ in watch.samples(_IMAGES // size, least=_FEWEST // size + 1):
        parts.append(measure.distance(render.expose(image, scene.noise, rng, size, where), scene, sensor).value_px)
    seconds = (time.perf_counter() - began) / (size * len(parts))
    values = np.concatenate(parts)
    values = values[np.isfinite(values)]
    rows = []
    for n in _COUNTS:
        if values.size < _GROUPS * n:
            break
        groups = values[: values.size // n * n].reshape(-1, n).var(1, ddof=1)
        rows.append((n, n * seconds, len(groups), float(groups.std(ddof=1) / groups.mean()), half_width(n)))
    if len(rows) < 4:
        raise InvalidInput(f"images must be measured in {_FEWEST} of them, got {values.size} that were")
    n, _, groups, found, widths = np.array(rows).T
    return Parameter(
        name="images",
        title="Noisy images a setting: error of the empirical variance",
        columns=("images", "seconds", "groups", "sigma of the variance", "95 % half-width"),
        rows=tuple(rows),
        x="images",
        y="sigma of the variance",
        fits=(
            Trend("sigma against images - 1", slope(n - 1, found, np.sqrt(groups)), -0.5),
            Trend("chi-square half-width against images", slope(n[2:], widths[2:]), -0.5),
        ),
        note="The half-width falls faster than -1/2 with few images, whose chi-square is skewed; fitted from 40 on.",
    )
