"""What a run has shown: one row a setting, the correlations and the verdict."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

import planner
import scenes
from scenes import InvalidInput
from validation import statistics
from validation.batch.campaign import Campaign, Case
from validation.batch.measurands import JudgedMeasurand, judged
from validation.batch.store import RunFile
from validation.batch.work import Method, methods
from validation.statistics import Verdict

_WAITING = "not yet worked on"


@dataclass(frozen=True)
class Judged:
    """One method in one setting: predicted from its image against measured.

    Variances in px^2. ``empirical`` is the sample variance of the ``n - failed`` distances, ``ratio`` empirical /
    propagated with its two-sided 95 % chi-square interval, ``bias`` the mean distance minus the model's, px,
    ``predicted_bias`` what the classic locators add without noise, and ``rmse`` the root mean square error
    sqrt(empirical + bias^2), px. The status is that of the noise-free image unless it is ``ok`` and more images are
    lost than may be (`row_status`).
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


@dataclass(frozen=True)
class Row:
    """One setting. ``paper`` has the one free scale; ``main`` is the verdict's method, ``classic`` are the others.

    They are about the first measurand, in the image; ``measurands`` are all of them by the verdict's method, in the
    scene's unit.

    ``value_px`` is the model's distance; ``parameters`` are the values that a campaign gave to keys of the scene.
    """

    index: int
    scene: str
    parameters: dict[str, Any]
    value_px: float
    sensor: tuple[float, float]
    light: tuple[float, float]
    paper_ice: float | None
    paper_real: tuple[float, float] | None
    paper: float
    calibrated: float
    bound: float
    main: Judged
    classic: tuple[Judged, ...]
    measurands: tuple[JudgedMeasurand, ...]


@dataclass(frozen=True)
class Validation:
    """The outcome of a run.

    ``paper_scale`` is the free scale: the median of paper_ice / our paper model over all rows that have both.
    ``refused`` tells of each setting without a row why, by its number. ``search`` repeats the paper's Table 1 with the
    same scale: (scene, sensor, light, paper, ours).
    """

    scene: str
    title: str
    seed: int
    variant: str
    paper_scale: float | None
    rows: tuple[Row, ...]
    refused: dict[int, str]
    search: tuple[tuple[str, tuple[float, float], tuple[float, float], float, float], ...]
    correlation: dict[str, Any]
    verdict: Verdict
    classic_verdicts: dict[str, Verdict]
    seconds: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """The document of ``ice validate --json``; numbers that are not finite become null."""
        return _finite(
            {
                "scene": self.scene,
                "seed": self.seed,
                "variant": self.variant,
                "paper_scale": self.paper_scale,
                "settings": [_row_json(row) for row in self.rows],
                "refused": [{"index": index, "reason": reason} for index, reason in self.refused.items()],
                "paper_table_1": [
                    {"scene": scene, "sensor": sensor, "light": light, "paper_ice": theirs, "paper": ours}
                    for scene, sensor, light, theirs, ours in self.search
                ],
                "correlation": self.correlation,
                "verdict": self.verdict.text,
                "judgement": asdict(self.verdict),
                "classic_verdicts": {name: asdict(found) for name, found in self.classic_verdicts.items()},
                "seconds": self.seconds,
            }
        )


def collect(campaign: Campaign, store: RunFile) -> Validation:
    """Put a run's results together.

    Raises
    ------
    InvalidInput
        If no setting could be worked on.
    """
    identity = store.identity()
    indices, refused = [], {}
    for i in range(len(campaign)):
        if store.predicted(i):
            indices.append(i)
        else:
            refused[i] = store.trouble(i) or _WAITING
    if not indices:
        reason = next(iter(refused.values()))
        raise InvalidInput("the run must have measured a setting, got none yet" if reason == _WAITING else reason)
    scale = _free_scale(campaign, indices, store)
    rows = tuple(_row(campaign.case(i), scale, store) for i in indices)
    return Validation(
        scene=campaign.name,
        title=campaign.title,
        seed=identity["seed"],
        variant=identity["variant"],
        paper_scale=scale,
        rows=rows,
        refused=refused,
        search=_search(campaign, scale),
        correlation=_correlations(rows),
        verdict=_verdict(rows, sum(reason != _WAITING for reason in refused.values())),
        classic_verdicts=_classic_verdicts(rows),
        seconds={"wall": store.fact("wall", 0.0), "workers": store.fact("workers", 0), **store.seconds()},
    )


def _classic_verdicts(rows: tuple[Row, ...]) -> dict[str, Verdict]:
    """Of each other method, over the settings that have it."""
    groups: dict[str, list[Judged]] = {}
    for row in rows:
        for each in row.classic:
            groups.setdefault(each.method, []).append(each)
    return {method: _judge(group) for method, group in groups.items()}


def _free_scale(campaign: Campaign, indices: list[int], store: RunFile) -> float | None:
    """The paper prints no unit of intensity; the median is deaf to the rows that do not fit."""
    if campaign.grid or campaign.sweep:
        return None
    known = [(campaign.case(i).setting.paper_ice, store.predicted(i)["paper"]) for i in indices]
    ratios = [ice / ours for ice, ours in known if ice and 0 < ours < math.inf]
    return float(np.median(ratios)) if ratios else None


def _row(case: Case, scale: float | None, store: RunFile) -> Row:
    setting, model = case.setting, store.predicted(case.index)
    main, *classic = (_judged(case.index, method, model, store) for method in methods(case.scene))
    return Row(
        index=case.index,
        scene=case.scene.name,
        parameters=case.parameters,
        value_px=model["value_px"],
        sensor=tuple(setting.sensor),
        light=tuple(setting.light),
        paper_ice=setting.paper_ice,
        paper_real=setting.paper_real,
        paper=model["paper"] * (scale or 1.0),
        calibrated=model["calibrated"],
        bound=model["bound"],
        main=main,
        classic=tuple(classic),
        measurands=judged(model["measurands"], main.method, case.index, store, row_status),
    )


def _judged(setting: int, method: Method, model: dict[str, float], store: RunFile) -> Judged:
    propagated, _, status = store.propagated(setting, method.name)
    distances = store.distances(setting, method.name)
    good = distances[np.isfinite(distances)]
    failures = store.failures(setting, method.name)
    empirical = float(np.var(good, ddof=1)) if good.size > 1 else None
    judged = empirical is not None and math.isfinite(propagated) and propagated > 0
    ratio = empirical / propagated if judged else None
    bias = float(good.mean() - model["value_px"]) if good.size and math.isfinite(model["value_px"]) else None
    return Judged(
        method=method.name,
        propagated=propagated,
        empirical=empirical,
        n=distances.size,
        failed=distances.size - good.size,
        failures=failures,
        ratio=ratio,
        ratio_interval=statistics.ratio_interval(ratio, good.size) if judged else None,
        bias=bias,
        predicted_bias=model["predicted_bias"],
        rmse=None if empirical is None or bias is None else math.hypot(math.sqrt(empirical), bias),
        status=row_status(status, failures, distances.size),
    )


def row_status(clean: str, others: dict[str, int], images: int) -> str:
    """Status of a setting: that of its noise-free image; if ``ok``, and too many of the noisy ones are not, theirs.

    Parameters
    ----------
    clean : str
        Status of the noise-free image.
    others : dict
        Number of noisy images by status, of those that are not ``ok``.
    images : int
        Noisy images in all; `statistics.STRAY` of them may be lost.

    Examples
    --------
    >>> row_status("ok", {"short": 1}, 100), row_status("ok", {"short": 1, "low_contrast": 2}, 100)
    ('ok', 'low_contrast')
    """
    if clean != "ok" or sum(others.values()) <= statistics.STRAY * images:
        return clean
    return max(others, key=others.get)


def _verdict(rows: tuple[Row, ...], refused: int) -> Verdict:
    """About every measurand of every setting; where there is one a setting, about its value in the image."""
    if all(len(row.measurands) == 1 for row in rows):
        return _judge([row.main for row in rows], refused)
    every = [each for row in rows for each in row.measurands]
    lost = [None] * refused

    def column(name: str, none: float = np.nan) -> np.ndarray:
        return np.array([none if each is None else getattr(each, name) for each in [*every, *lost]], float)

    return statistics.verdict(
        column("ratio"),
        column("n", 0) - column("failed", 0),
        lost=column("failed", 0),
        bias_px=column("bias"),
        predicted_bias_px=column("predicted_bias"),
        sigma_px=np.sqrt(column("predicted")),
        ok=[*(each.status == "ok" for each in every), *(False for _ in lost)],
        independent=column("independent", 1.0),
    )


def _judge(rows: list[Judged], refused: int = 0) -> Verdict:
    """Of one method; a setting that could not be worked on counts as one that was not measured."""
    listed = [*rows, *[_NOTHING] * refused]

    def column(name: str) -> np.ndarray:
        return np.array([getattr(j, name) for j in listed], float)  # None becomes NaN

    return statistics.verdict(
        column("ratio"),
        column("n") - column("failed"),
        lost=column("failed"),
        bias_px=column("bias"),
        predicted_bias_px=column("predicted_bias"),
        sigma_px=np.sqrt(column("propagated")),
        ok=[j.status == "ok" for j in listed],
    )


_NOTHING = Judged("", math.inf, None, 0, 0, {}, None, None, None, 0.0, None, "refused")


def _correlations(rows: tuple[Row, ...]) -> dict[str, Any]:
    empirical = [row.main.empirical for row in rows]
    real = [row.paper_real or (None, None) for row in rows]
    ice = [row.paper_ice for row in rows]
    return {
        "paper_with_empirical": statistics.correlation([row.paper for row in rows], empirical),
        "calibrated_with_empirical": statistics.correlation([row.calibrated for row in rows], empirical),
        "propagated_with_empirical": statistics.correlation([row.main.propagated for row in rows], empirical),
        "printed_ice_with_empirical": statistics.correlation(ice, empirical),
        "printed_ice_with_printed_real_12": statistics.correlation(ice, [pair[0] for pair in real]),
        "printed_ice_with_printed_real_10": statistics.correlation(ice, [pair[1] for pair in real]),
        "claimed_by_paper": 0.768 if any(ice) else None,
    }


def _search(campaign: Campaign, scale: float | None):
    if scale is None:
        return ()
    found = []
    for other in map(scenes.load, campaign.scenes[0].same_scale):
        for setting in other.settings:
            ours = planner.predict(other, setting.sensor, setting.light, "paper").variance_image * scale
            found.append((other.name, tuple(setting.sensor), tuple(setting.light), setting.paper_ice, ours))
    return tuple(found)


def _row_json(row: Row) -> dict[str, Any]:
    main = asdict(row.main)
    return {
        "index": row.index,
        "scene": row.scene,
        "parameters": row.parameters,
        "sensor": row.sensor,
        "light": row.light,
        "value_px": row.value_px,
        "paper_ice": row.paper_ice,
        "paper_real": row.paper_real,
        "predicted": {"paper": row.paper, "calibrated": row.calibrated, "propagated": main.pop("propagated")},
        **main,
        "bound": row.bound,
        "classic": [asdict(each) for each in row.classic],
        "measurands": [asdict(each) for each in row.measurands],
    }


def _finite(value: Any) -> Any:
    """The same document with null for NaN and infinity, which JSON lacks."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
