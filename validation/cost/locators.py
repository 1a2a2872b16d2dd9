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

_IMAGES = 200


def estimators_parameter(cases: Sequence[Case], images: Sequence[np.ndarray], seed: int) -> Parameter:
    """Variance of the distance over its bound, and processor time an image, on the same noisy images."""
    ratios = {name: [] for name in measure.ESTIMATORS}
    seconds, failed = dict.fromkeys(measure.ESTIMATORS, 0.0), dict.fromkeys(measure.ESTIMATORS, 0)
    for case, image in zip(cases, images, strict=True):
        scene, sensor, light = case.scene, case.setting.sensor, case.setting.light
        bound = planner.predict(scene, sensor, light, "bound").variance_px2
        pictures = render.expose(image, scene.noise, np.random.default_rng(seed), _IMAGES)
        for name in measure.ESTIMATORS:
            measure.distance(pictures[:50], scene, sensor, light, name)  # prepares it
            began = time.process_time()
            values = measure.distance(pictures, scene, sensor, light, name).value_px
            seconds[name] += (time.process_time() - began) / _IMAGES / len(cases)
            good = values[np.isfinite(values)]
            failed[name] += values.size - good.size
            if good.size > 1:
                ratios[name].append(good.var(ddof=1) / bound)
    rows = []
    for name in measure.ESTIMATORS:
        ratio, spent = float(np.mean(ratios[name] or np.nan)), 1e3 * seconds[name]
        rows.append((name, spent, ratio, 1 / ratio, spent * ratio, failed[name]))
    error = float(np.sqrt(2 / (_IMAGES - 1) / len(cases)))
    return Parameter(
        name="estimators",
        title="Estimators: variance over the Cramer-Rao bound against time",
        columns=("estimator", "ms an image", "variance / bound", "efficiency", "ms x variance / bound", "failed"),
        rows=tuple(rows),
        x="ms an image",
        y="variance / bound",
        series="estimator",
        note=f"{_IMAGES} images of each of {len(cases)} settings: the variances are known to {error:.0%} (1 sigma). "
        "ms x variance / bound: processor time for a given precision of a mean.",
    )
