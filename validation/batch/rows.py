"""The settings of a run, kept as columns: a million of them take some 450 MB, as objects they would take gigabytes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenes import pairs
from scenes.status import is_trusted
from validation import statistics
from validation.batch.campaign import Campaign
from validation.batch.measurands import JudgedMeasurand, Measured
from validation.batch.repeated import FOUND, STATUSES, RepeatedValues, judged, known, ratios, row_status


@dataclass(frozen=True)
class Judged:
    """One method in one setting: predicted from its image against measured.

    Variances in px^2. ``empirical`` is the sample variance of the ``n - failed`` distances, ``ratio`` empirical /
    propagated with its two-sided 95 % chi-square interval, ``bias`` the mean of the corrected distances minus the
    model's, px, ``correction`` what was taken off each of them, the bias in a render of other rays, ``u_bias`` that
    one's standard uncertainty (None where nothing was), ``render_noise`` the standard deviation of ``bias`` by the
    renderer's own noise, which no number of images averages out, px, ``predicted_bias`` the mean error that is expected
    (0 where it was taken off, else what the classic locators add without noise), and ``rmse`` the root mean square
    error sqrt(empirical + bias^2), px. The status is that of the noise-free image unless it is ``ok`` and more images
    are lost than may be (`row_status`).
    """

    method: str
    propagated: float
    empirical: float | None
    n: int
    failed: int
    failures: dict[str, int]
    ratio: float | None
    ratio_interval: tuple[float, float] | None
    bias: float | None
    predicted_bias: float
    rmse: float | None
    status: str
    correction: float = 0.0
    u_bias: float | None = None
    render_noise: float = 0.0


@dataclass(frozen=True)
class Row:
    """One setting. ``paper`` has the one free scale; ``main`` is the verdict's method, ``classic`` are the others.

    They are about the first measurand, in the image; ``measurands`` are all of them by the verdict's method, in the
    scene's unit.

    ``value_px`` is the model's distance; ``parameters`` are the values that a campaign gave to keys of the scene;
    ``texture`` is the predicted variance over parts by textures, None where there are none.
    """

    index: int
    scene: str
    parameters: dict[str, Any]
    value_px: float
    sensor: tuple[float, float]
    light: tuple[Any, ...]
    paper_ice: float | None
    paper_real: tuple[float, float] | None
    paper: float
    calibrated: float
    bound: float
    main: Judged
    classic: tuple[Judged, ...]
    measurands: tuple[JudgedMeasurand, ...]
    texture: float | None = None


MEAN_ERROR = ("bias", "predicted_bias", "u_bias", "render_noise")  # and what is expected of it
MODEL = ("value_px", "paper", "calibrated", "bound", "predicted_bias", "texture")


def _record(methods: int) -> np.dtype:
    each = [("propagated", "f8"), *FOUND, ("failures", "i4"), ("clean", "u1")]
    return np.dtype([
        ("index", "i4"), ("kind", "i4"), *((name, "f8") for name in MODEL), ("judged", each, (methods,)),
    ])  # fmt: skip


class Rows(Sequence[Row]):
    """Rows made when they are asked for, from numbers in an array.

    Parameters
    ----------
    campaign : Campaign
        Knows poses and swept values by a setting's number.
    """

    def __init__(self, campaign: Campaign) -> None:
        self._campaign, self._size = campaign, 0
        self._records = np.zeros(len(campaign), _record(1))  # memory is taken where it is written to
        self._kinds: list[tuple[str, tuple[str, ...]]] = []  # scene and methods, which few settings differ in
        self._places: dict[tuple[str, tuple[str, ...]], int] = {}
        self._failures: list[dict[str, int]] = []  # images by status; most settings are alike
        self._numbered: dict[tuple[tuple[str, int], ...], int] = {}
        self.measured = Measured(len(campaign))

    def add(
        self,
        index: int,
        scene: str,
        model: dict[str, Any],
        found: dict[str, RepeatedValues],
        each: list[RepeatedValues],
    ) -> None:
        """Append a setting.

        Parameters
        ----------
        model : dict
            Predictions without an image.
        found : dict of RepeatedValues
            Of the first measurand by each method, the verdict's first.
        each : list of RepeatedValues
            Of each measurand, in the scene's unit, by the verdict's method.
        """
        kind = self._kind(scene, tuple(found))
        record = self._records[self._size]
        record["index"], record["kind"] = index, kind
        for name in MODEL:
            record[name] = model.get(name, math.nan)
        for place, one in zip(record["judged"], found.values(), strict=False):
            place["propagated"], place["clean"] = one.propagated, STATUSES.index(one.clean)
            one.note(place, model["value_px"], record["predicted_bias"])
            place["failures"] = self._failure(one.failures)
        self.measured.add(model["measurands"], each)
        self._size += 1

    def _kind(self, scene: str, methods: tuple[str, ...]) -> int:
        """Number of a kind of setting; the records get room for its methods."""
        key, there = (scene, methods), self._records["judged"].shape[1]  # ty: ignore[index-out-of-bounds]
        if len(methods) > there:
            wider = np.zeros(len(self._records), _record(len(methods)))
            some = slice(self._size)
            for name in ("index", "kind", *MODEL):
                wider[name][some] = self._records[name][some]
            wider["judged"][some, :there] = self._records["judged"][some]
            self._records = wider
        if key not in self._places:
            self._places[key] = len(self._kinds)
            self._kinds.append(key)
        return self._places[key]

    def _failure(self, failures: dict[str, int]) -> int:
        """Number of what failed how often."""
        key = tuple(sorted(failures.items()))
        if key not in self._numbered:
            self._numbered[key] = len(self._failures)
            self._failures.append(dict(key))
        return self._numbered[key]

    def finish(self, scale: float | None) -> None:
        """Once all are there: the paper model's free scale."""
        self._records = self._records[: self._size]
        self._records["paper"] *= scale or 1.0
        self.measured.finish()

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, which):
        if isinstance(which, slice):
            return [self[i] for i in range(*which.indices(self._size))]
        return self._row(range(self._size)[which])

    def __iter__(self):
        return map(self._row, range(self._size))

    def column(self, name: str) -> np.ndarray:
        """A number of `Row`, all settings."""
        return self._records[name]

    def judged(self, method: str | None = None) -> dict[str, np.ndarray]:
        """Numbers of one method, or of the verdict's, by name of `Judged`; of the settings that have it; NaN: none."""
        rows, places = [], []
        for kind, (_, names) in enumerate(self._kinds):
            if method is None or method in names[1:]:
                some = np.flatnonzero(self._records["kind"] == kind)
                rows.append(some)
                places.append(np.full(some.size, 0 if method is None else names.index(method)))
        chosen, place = np.concatenate(rows), np.concatenate(places)
        order = np.argsort(chosen, kind="stable")
        chosen, place = chosen[order], place[order]

        def numbers(name: str) -> np.ndarray:
            return self._records["judged"][name][chosen, place]

        found = {name: numbers(name) for name in ("propagated", "empirical", "n", "failed", *MEAN_ERROR)}
        return {
            **found, "ratio": ratios(found["empirical"], found["propagated"]),
            "status": self._statuses(numbers), "independent": np.ones(chosen.size),
        }  # fmt: skip

    def _statuses(self, numbers: Callable[[str], np.ndarray]) -> np.ndarray:
        """Of one method's rows: `row_status`, asked only where images are lost from a picture that is ``ok``."""
        found, which, count = np.array(STATUSES, object)[numbers("clean")], numbers("failures"), numbers("n")
        stray = np.array([sum(failures.values()) for failures in self._failures])[which]
        for row in np.flatnonzero(is_trusted(found) & (stray > statistics.STRAY * count)):
            found[row] = row_status(found[row], self._failures[which[row]], int(count[row]))
        return found

    @property
    def others(self) -> list[str]:
        """Names of all methods but the verdict's."""
        return list(dict.fromkeys(name for _, names in self._kinds for name in names[1:]))

    def _row(self, number: int) -> Row:
        record = self._records[number]
        index = int(record["index"])
        setting, parameters = self._campaign.at(index)
        scene, names = self._kinds[int(record["kind"])]
        numbers = {name: float(record[name]) for name in MODEL} | {"texture": known(record["texture"])}
        numbers.pop("predicted_bias")
        each = [
            _judged(name, place, self._failures[place["failures"]])
            for name, place in zip(names, record["judged"], strict=False)
        ]
        return Row(
            index=index, scene=scene, parameters=parameters, sensor=tuple(setting.sensor), light=pairs(setting.light),
            paper_ice=setting.paper_ice, paper_real=setting.paper_real, main=each[0], classic=tuple(each[1:]),
            measurands=self.measured[number], **numbers,
        )  # fmt: skip


def _judged(method: str, place: np.void, failures: dict[str, int]) -> Judged:
    propagated = float(place["propagated"])
    told = judged(place, propagated)
    unknown = told["empirical"] is None or told["bias"] is None
    return Judged(
        method=method,
        propagated=propagated,
        failures=failures,
        rmse=None if unknown else math.hypot(math.sqrt(told["empirical"]), told["bias"]),
        status=row_status(STATUSES[place["clean"]], failures, told["n"]),
        **told,
    )
