"""What a run has shown: one row a setting, the correlations and the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import planner
import scenes
from scenes import InvalidInput, pairs, status
from scenes.results import Shown, poses
from validation import statistics
from validation.batch.campaign import Campaign
from validation.batch.document import document
from validation.batch.measurands import column
from validation.batch.overview import Overview
from validation.batch.repeated import RepeatedValues
from validation.batch.rows import MEAN_ERROR, Row, Rows
from validation.batch.store import RunFile
from validation.batch.work import methods
from validation.statistics import Verdict

WAITING = "not yet worked on"
SHOWN = 64  # rows of a table, those that are farthest from their prediction; table.csv has all


@dataclass(frozen=True, repr=False)
class Validation(Shown):
    """The outcome of a run.

    ``paper_scale`` is the free scale: the median of paper_ice / our paper model over all rows that have both.
    ``refused`` tells of each setting without a row why, by its number. ``search`` repeats the paper's Table 1 with the
    same scale: (scene, sensor, light, paper, ours). ``machines`` are those that worked on it, where it was begun first.
    """

    scene: str
    title: str
    seed: int
    variant: str
    paper_scale: float | None
    rows: Sequence[Row]
    refused: dict[int, str]
    search: tuple[tuple[str, tuple[float, float], tuple[float, float], float, float], ...]
    correlation: dict[str, Any]
    verdict: Verdict
    classic_verdicts: dict[str, Verdict]
    seconds: dict[str, float]
    machines: tuple[dict[str, Any], ...] = ()

    @cached_property
    def overview(self) -> Overview:
        """Of all settings."""
        return Overview.of(self.rows, SHOWN)

    def to_json(self) -> dict[str, Any]:
        """The document of ``ice validate --json``; numbers that are not finite become null."""
        return document(self)

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a setting and measurand: poses, variances in the scene's unit squared, ratio, status."""
        return [
            {"scene": row.scene, **poses(row.sensor, row.light), **row.parameters, **each.record}
            for row in self.rows
            for each in row.measurands
        ]

    def _line(self) -> str:
        return f"{self.scene}: {len(self.rows)} settings, {self.verdict.text.split(';')[0]}"


def collect(campaign: Campaign, store: RunFile) -> Validation:
    """Put a run's results together.

    Raises
    ------
    InvalidInput
        If no setting could be worked on.
    """
    identity = store.identity()
    rows, refused = Rows(campaign), {}
    truth = (identity.get("photos") or {}).get("exact_poses", True)
    for i in range(len(campaign)):
        model = store.predicted(i)
        if model:
            scene = campaign.case(i).scene
            off = model.get("corrections", {})
            found = {m.name: _found(i, m.name, store, off.get(m.name)) for m in methods(scene)}
            main = next(iter(found))
            each = [_found(i, column(main, k), store, m.get("correction")) for k, m in enumerate(model["measurands"])]
            rows.add(i, scene.name, model, found, each)
        else:
            refused[i] = store.trouble(i) or WAITING
    if not rows:
        reason = next(iter(refused.values()))
        raise InvalidInput("the run must have measured a setting, got none yet" if reason == WAITING else reason)
    scale = _free_scale(campaign, rows)
    rows.finish(scale)
    return Validation(
        scene=campaign.name,
        title=campaign.title,
        seed=identity["seed"],
        variant=identity["variant"],
        paper_scale=scale,
        rows=rows,
        refused=refused,
        search=_search(campaign, scale),
        correlation=_correlations(campaign, rows),
        verdict=_verdict(rows, sum(reason != WAITING for reason in refused.values()), truth),
        classic_verdicts={name: _judge(rows.judged(name), truth=truth) for name in rows.others},
        seconds={"wall": store.fact("wall", 0.0), "workers": store.fact("workers", 0), **store.seconds()},
        machines=tuple(store.fact("machines", [])),
    )


def _found(setting: int, method: str, store: RunFile, off: dict[str, float] | None) -> RepeatedValues:
    propagated, _, status = store.propagated(setting, method)
    correction = {} if off is None else {"correction": off["bias"], "u_bias": off["u"], "render_noise": off["noise"]}
    return RepeatedValues(
        propagated, store.distances(setting, method), store.failures(setting, method), status, **correction
    )


def _printed(campaign: Campaign) -> bool:
    """Whether the settings are those that scenes list, beside numbers that the paper printed."""
    return not (campaign.grid or campaign.sweep)


def _free_scale(campaign: Campaign, rows: Rows) -> float | None:
    """The paper prints no unit of intensity; the median is deaf to the rows that do not fit."""
    if not _printed(campaign):
        return None
    ratios = [row.paper_ice / row.paper for row in rows if row.paper_ice and 0 < row.paper < math.inf]
    return float(np.median(ratios)) if ratios else None


def _verdict(rows: Rows, refused: int, truth: bool) -> Verdict:
    """About every measurand of every setting; where there is one a setting, about its value in the image."""
    measured = rows.measured
    if measured.are_single:
        return _judge(rows.judged(), refused, truth)
    names = ("ratio", "n", "failed", "status", "independent", *MEAN_ERROR)
    found = {name: measured.column(name) for name in names}
    return _judge({**found, "propagated": measured.column("predicted")}, refused, truth)


def _judge(found: dict[str, np.ndarray], refused: int = 0, truth: bool = True) -> Verdict:
    """Of one method; a setting that could not be worked on counts as one that was not measured.

    Without ``truth`` nothing is said of mean errors: of photographs nobody knows where exactly they were taken.
    """

    def column(name: str, nothing: float) -> np.ndarray:
        known = found[name].astype(float, copy=False)
        return np.concatenate([known, np.full(refused, nothing)]) if refused else known

    return statistics.verdict(
        column("ratio", np.nan),
        column("n", 0) - column("failed", 0),
        lost=column("failed", 0),
        bias_px=column("bias", np.nan) if truth else None,
        predicted_bias_px=column("predicted_bias", 0.0),
        sigma_px=np.sqrt(column("propagated", np.inf)),
        u_bias_px=column("u_bias", np.nan),
        render_noise_px=column("render_noise", 0.0),
        status=np.concatenate([found["status"], np.full(refused, status.NOT_VISIBLE, object)]),
        independent=column("independent", 1.0),
    )


def _correlations(campaign: Campaign, rows: Rows) -> dict[str, Any]:
    main = rows.judged()
    empirical, nothing = main["empirical"], np.full(len(rows), np.nan)
    ice, real = nothing, np.stack([nothing, nothing])
    if _printed(campaign):
        ice = np.array([row.paper_ice for row in rows], float)
        real = np.array([row.paper_real or (None, None) for row in rows], float).T
    return {
        "paper_with_empirical": statistics.correlation(rows.column("paper"), empirical),
        "calibrated_with_empirical": statistics.correlation(rows.column("calibrated"), empirical),
        "propagated_with_empirical": statistics.correlation(main["propagated"], empirical),
        "printed_ice_with_empirical": statistics.correlation(ice, empirical),
        "printed_ice_with_printed_real_12": statistics.correlation(ice, real[0]),
        "printed_ice_with_printed_real_10": statistics.correlation(ice, real[1]),
        "claimed_by_paper": 0.768 if np.nansum(ice) else None,
    }


def _search(campaign: Campaign, scale: float | None):
    if scale is None:
        return ()
    found = []
    for other in map(scenes.load, campaign.scenes[0].same_scale):
        for setting in other.settings:
            ours = planner.predict(other, setting.sensor, setting.light, "paper").variance_image * scale
            found.append((other.name, tuple(setting.sensor), pairs(setting.light), setting.paper_ice, ours))
    return tuple(found)
