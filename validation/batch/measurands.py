"""Every measurand of a setting: what is predicted of it, and how it was measured, in the scene's unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

import planner
from measure.propagation import PropagatedValues
from validation import statistics

FIELDS = ("paper", "calibrated", "bound")


def column(method: str, number: int) -> str:
    """Under which name a method's values of a measurand stand in a run file, in the scene's unit or degrees.

    >>> column("gradient", 2)
    'gradient:2'
    """
    return f"{method}:{number}"


def predicted(forecasts: dict[str, planner.Prediction]) -> list[dict[str, Any]]:
    """What the variance models say of each measurand, by model; variances in the object."""
    told = []
    for k, each in enumerate(forecasts["calibrated"].measurands):
        variances = {model: forecasts[model].measurands[k].variance_object for model in FIELDS}
        about = {"name": each.name, "kind": each.kind, "unit": each.unit, "value": each.value_object}
        told.append({**about, "predicted_bias": each.bias_object, **variances})
    return told


def propagated(method: str, found: PropagatedValues, spread: np.ndarray) -> dict[str, tuple[float, float, str]]:
    """Variance, value and status of each measurand, with the scatter of the poses added, by `column`."""
    return {
        column(method, k): (float(found.covariance[k, k] + spread[k]), float(found.value[k]), state)
        for k, state in enumerate(found.status)
    }


@dataclass(frozen=True)
class JudgedMeasurand:
    """One measurand of one setting, by the verdict's method, in the scene's unit or degrees.

    ``predicted`` is the variance propagated on the noise-free image, ``empirical`` that of the ``n - failed`` values;
    ``ratio`` and its interval, ``bias`` (mean less the object's value), ``predicted_bias`` and ``status`` as of
    `Judged`. ``independent`` is how many independent measurands of the setting it counts for, from their correlations.
    """

    name: str
    kind: str
    unit: str
    value: float
    paper: float
    calibrated: float
    predicted: float
    empirical: float | None
    n: int
    failed: int
    ratio: float | None
    ratio_interval: tuple[float, float] | None
    bias: float | None
    predicted_bias: float
    bound: float
    status: str
    independent: float


def judged(model: list[dict[str, Any]], method: str, setting: int, store, row_status) -> tuple[JudgedMeasurand, ...]:
    """All measurands of a setting, from a run file."""
    values = [store.distances(setting, column(method, k)) for k in range(len(model))]
    share = _independent(values)
    found = []
    for k, (told, measured) in enumerate(zip(model, values, strict=True)):
        variance, _, state = store.propagated(setting, column(method, k))
        good = measured[np.isfinite(measured)]
        empirical = float(np.var(good, ddof=1)) if good.size > 1 else None
        known = empirical is not None and math.isfinite(variance) and variance > 0
        ratio = empirical / variance if known else None
        failures = store.failures(setting, column(method, k))
        found.append(
            JudgedMeasurand(
                **{key: told[key] for key in ("name", "kind", "unit", "value", "predicted_bias", *FIELDS)},
                predicted=variance,
                empirical=empirical,
                n=measured.size,
                failed=measured.size - good.size,
                ratio=ratio,
                ratio_interval=statistics.ratio_interval(ratio, good.size) if known else None,
                bias=float(good.mean() - told["value"]) if good.size else None,
                status=row_status(state, failures, measured.size),
                independent=share,
            )
        )
    return tuple(found)


def _independent(values: list[np.ndarray]) -> float:
    """For how many independent sample variances each of M correlated ones counts: M over the sum of rho^2."""
    together = np.stack(values)
    together = together[:, np.isfinite(together).all(0)]
    if len(together) < 2 or together.shape[1] < 3 or not (np.ptp(together, axis=1) > 0).all():
        return 1.0
    return len(together) / float((np.corrcoef(together) ** 2).sum())
