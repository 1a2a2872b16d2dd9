"""Estimators: how near to the Cramer-Rao bound each comes, and how long an image takes it."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

import measure
import planner
import render
from validation.batch.campaign import Case
from validation.cost.parameter import Parameter
from validation.cost.watch import Watch, at_once

_IMAGES, _FEWEST = 200, 20  # of each setting


def estimators_parameter(
    cases: Sequence[Case], images: Sequence[np.ndarray], seed: int, watch: Watch = Watch()
) -> Parameter:
    """Variance of the distance over its bound, and processor time an image, on the same noisy images."""
    ratios = {name: [] for name in measure.ESTIMATORS}
    spent, failed = dict.fromkeys(measure.ESTIMATORS, 0.0), dict.fromkeys(measure.ESTIMATORS, 0)
    count = 0  # images of all settings
    for case, image in zip(cases, images, strict=True):
        scene, sensor, light = case.scene, case.setting.sensor, case.setting.light
        bound = planner.predict(scene, sensor, light, "bound").variance_px2
        rng, size = np.random.default_rng(seed), at_once(image.size, 50)
        for name in measure.ESTIMATORS:
            measure.distance(image, scene, sensor, light, name)  # prepares it
        parts: dict[str, list[np.ndarray]] = {name: [] for name in measure.ESTIMATORS}
        part = Watch(watch.left / len(cases), watch.tell)
        for _ in part.samples(-(-_IMAGES // size), least=-(-_FEWEST // size)):
            pictures = render.expose(image, scene.noise, rng, size)
            for name, found in parts.items():
                began = time.process_time()
                found.append(measure.distance(pictures, scene, sensor, light, name).value_px)
                spent[name] += time.process_time() - began
        count += size * len(found)
        for name, found in parts.items():
            values = np.concatenate(found)
            good = values[np.isfinite(values)]
            failed[name] += values.size - good.size
            if good.size > 1:
                ratios[name].append(good.var(ddof=1) / bound)
    rows = []
    for name in measure.ESTIMATORS:
        ratio, each_ms = float(np.mean(ratios[name] or np.nan)), 1e3 * spent[name] / count
        rows.append((name, each_ms, ratio, 1 / ratio, each_ms * ratio, failed[name]))
    error = float(np.sqrt(2 / (count - len(cases))))
    return Parameter(
        name="estimators",
        title="Estimators: variance over the Cramer-Rao bound against time",
        columns=("estimator", "ms an image", "variance / bound", "efficiency", "ms x variance / bound", "failed"),
        rows=tuple(rows),
        x="ms an image",
        y="variance / bound",
        series="estimator",
        note=f"{count} images of {len(cases)} settings: the variances are known to {error:.0%} (1 sigma). "
        "ms x variance / bound: processor time for a given precision of a mean.",
    )
