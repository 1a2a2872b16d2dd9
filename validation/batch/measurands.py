"""Every measurand of a setting: what is predicted of it, and how it was measured, in the scene's unit."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import planner
from measure.propagation import PropagatedValues
from validation.batch.repeated import FOUND, STATUSES, RepeatedValues, judged, known, ratios, row_status

FIELDS = ("paper", "calibrated", "bound")


def column(method: str, number: int) -> str:
    """Under which name a method's values of a measurand stand in a run file, in the scene's unit or degrees.

    >>> column("gradient", 2)
    'gradient:2'
    """
    return f"{method}:{number}"


def predicted(forecasts: dict[str, planner.Prediction], biased: str) -> list[dict[str, Any]]:
    """What the variance models say of each measurand, by model, and ``biased`` of its bias; in the object."""
    told = []
    for k, each in enumerate(forecasts["calibrated"].measurands):
        bias = forecasts[biased].measurands[k].bias_object
        variances = {model: forecasts[model].measurands[k].variance_object for model in FIELDS}
        about = {"name": each.name, "kind": each.kind, "unit": each.unit, "value": each.value_object}
        told.append({**about, "predicted_bias": bias, **texture(each.texture_variance_object), **variances})
    return told


def texture(variance: float | None) -> dict[str, float]:
    """Variance over parts by textures under its key, which is absent where there are none, or it is not known."""
    return {} if variance is None or np.isnan(variance) else {"texture": variance}


def propagated(
    method: str, found: PropagatedValues, spread: np.ndarray, states: tuple[str, ...]
) -> dict[str, tuple[float, float, str]]:
    """Variance, value and status of each measurand, with the scatter of the poses added, by `column`."""
    return {
        column(method, k): (float(found.covariance[k, k] + spread[k]), float(found.value[k]), state)
        for k, state in enumerate(states)
    }


def correction(bias: float, u: float, noise: float) -> dict[str, float]:
    """A bias that is taken off, its standard uncertainty and `render_noise` as a run file has them.

    0 and infinite: not known.
    """
    return {"bias": float(np.nan_to_num(bias)), "u": float(u), "noise": float(noise)}


@dataclass(frozen=True)
class JudgedMeasurand:
    """One measurand of one setting, by the verdict's method, in the scene's unit or degrees.

    ``predicted`` is the variance propagated on the noise-free image, ``empirical`` that of the ``n - failed`` values;
    ``ratio`` and its interval, ``bias`` (mean of the corrected values less the object's), ``correction``, ``u_bias``,
    ``render_noise``, ``predicted_bias`` and ``status`` as of `Judged`; ``u`` is sqrt(predicted + u_bias^2), what a
    value is told with. ``independent`` is how many independent measurands of the setting it counts for, from their
    correlations. ``texture`` is the predicted variance over parts by textures, None where there are none, or it is not
    known.
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
    texture: float | None = None
    correction: float = 0.0
    u_bias: float | None = None
    render_noise: float = 0.0
    u: float | None = None

    @property
    def record(self) -> dict[str, Any]:
        """All fields, the interval's ends as two of them."""
        low, high = self.ratio_interval or (None, None)
        facts = {key: value for key, value in vars(self).items() if key != "ratio_interval"}
        return facts | {"ratio_low": low, "ratio_high": high}


_NUMBERS = ("value", *FIELDS, "predicted", "independent")
_RECORD = np.dtype(
    [("about", "i4"), *((name, "f8") for name in (*_NUMBERS, "texture", "ratio")), *FOUND, ("status", "u1")]
)


class Measured(Sequence[tuple[JudgedMeasurand, ...]]):
    """The measurands of each setting of a run, kept as columns and made when they are asked for.

    Parameters
    ----------
    settings : int
        How many there may be.
    """

    def __init__(self, settings: int) -> None:
        self._records, self._size, self._first = np.zeros(settings, _RECORD), 0, array("q", [0])
        self._about: dict[tuple[str, str, str], int] = {}  # name, kind and unit, which few settings differ in

    def add(self, told: list[dict[str, Any]], found: list[RepeatedValues]) -> None:
        """Append a setting: what is predicted of each measurand (`predicted`), and what was measured."""
        self._grow(len(told))
        share = independent([each.distances for each in found])
        for about, each in zip(told, found, strict=True):
            record = self._records[self._size]
            key = about["name"], about["kind"], about["unit"]
            record["about"] = self._about.setdefault(key, len(self._about))
            for name in ("value", *FIELDS):
                record[name] = about[name]
            record["texture"] = about.get("texture", np.nan)
            record["predicted"], record["independent"] = each.propagated, share
            each.note(record, about["value"], about["predicted_bias"])
            record["status"] = STATUSES.index(row_status(each.clean, each.failures, each.distances.size))
            self._size += 1
        self._first.append(self._size)

    def _grow(self, more: int) -> None:
        if self._size + more > len(self._records):
            self._records = np.concatenate([self._records, np.zeros(len(self._records) + more, _RECORD)])

    def finish(self) -> None:
        """Once all are there: all ratios at a time."""
        found = self._records = self._records[: self._size]
        found["ratio"] = ratios(found["empirical"], found["predicted"])

    def __len__(self) -> int:
        return len(self._first) - 1

    def __getitem__(self, which):
        number = range(len(self))[which]
        texts = list(self._about)
        return tuple(_judged(record, texts) for record in self._records[self._first[number] : self._first[number + 1]])

    @property
    def are_single(self) -> bool:
        """Whether there is one measurand a setting."""
        return self._size == len(self)

    def column(self, name: str) -> np.ndarray:
        """A number of all measurands of all settings, NaN where there is none; ``status`` as text."""
        return np.array(STATUSES, object)[self._records["status"]] if name == "status" else self._records[name]


def _judged(record: np.void, texts: list[tuple[str, str, str]]) -> JudgedMeasurand:
    name, kind, unit = texts[record["about"]]
    predicted = float(record["predicted"])
    told = judged(record, predicted)
    u = None if told["u_bias"] is None else float(np.hypot(np.sqrt(predicted), told["u_bias"]))
    return JudgedMeasurand(
        name=name, kind=kind, unit=unit, status=STATUSES[record["status"]], texture=known(record["texture"]), u=u,
        **{key: float(record[key]) for key in _NUMBERS}, **told,
    )  # fmt: skip


def independent(values: list[np.ndarray]) -> float:
    """For how many independent sample variances each of M correlated ones counts: M over the sum of rho^2."""
    together = np.stack(values)
    together = together[:, np.isfinite(together).all(0)]
    if len(together) < 2 or together.shape[1] < 3 or not (np.ptp(together, axis=1) > 0).all():
        return 1.0
    return len(together) / float((np.corrcoef(together) ** 2).sum())
