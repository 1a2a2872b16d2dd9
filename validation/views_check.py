"""Do several planned pictures together measure as precisely as predicted? Each is rendered, and measured many times."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

import measure
import planner
import render
from render import Quality
from scenes import Picture, Pose
from scenes.status import counted, is_trusted
from validation import statistics
from validation.batch.measurands import independent
from validation.defaults import DEFAULT_SEED
from validation.remeasured import GRADIENT, Sample, batches, propagated, remeasured

IMAGES = 300  # of each picture: a variance is known to 8 %
_PIXELS = 1 << 23  # of the images measured at a time


@dataclass(frozen=True)
class CheckedQuantity:
    """A quantity combined from K pictures, in the scene's unit or degrees.

    Attributes
    ----------
    pictures : int
        K.
    name, unit, status : str
        As of the plan.
    predicted, propagated : float
        Variance of the combination by the weights of the plan: as the plan says, and with the variances that the
        noise-free pictures tell; infinite where they tell none.
    empirical : float or None
        Sample variance of ``n`` combined values.
    n, failed : int
        Combined values, and those for which a picture gave none.
    ratio : float or None
        empirical / predicted, and its 95 % chi-square interval; the same of the least-squares combination.
    ratio_least_squares : float or None
    bias, predicted_bias : float
        Mean less the object's value, and what the plan says of it.
    judged : bool
        Whether the verdict is about it: its status is trusted.
    """

    pictures: int
    name: str
    unit: str
    status: str
    predicted: float
    propagated: float
    empirical: float | None
    n: int
    failed: int
    ratio: float | None
    ratio_interval: tuple[float, float] | None
    ratio_least_squares: float | None
    interval_least_squares: tuple[float, float] | None
    bias: float | None
    predicted_bias: float
    judged: bool


@dataclass(frozen=True)
class ViewsCheck:
    """All quantities of all sets of pictures.

    Attributes
    ----------
    rows : tuple of CheckedQuantity
    verdict : Verdict or None
        Of the combinations by inverse variance; None, with the reason, where there is nothing to judge.
    reason : str
    seconds : float
    """

    rows: tuple[CheckedQuantity, ...]
    verdict: statistics.Verdict | None
    reason: str
    seconds: float


@dataclass(frozen=True, eq=False)
class _Shot:
    """A picture measured: values (repeats, images, M) and the noise-free picture's joint covariance (M, M)."""

    values: np.ndarray
    covariance: np.ndarray


def check_views(
    found: planner.Views,
    images: int = IMAGES,
    seed: int = DEFAULT_SEED,
    quality: Quality = Quality(),
    report: Callable[[str, int, int], None] = lambda *_: None,
) -> ViewsCheck:
    """Render every picture of a plan once, add noise many times, measure, combine by the plan's weights, and compare.

    Pictures that a set has several times get noise of their own each time.

    Parameters
    ----------
    found : Views
    images : int
        Noisy images of each picture.
    """
    began = time.perf_counter()
    if found.model == "paper":
        return ViewsCheck((), None, "the paper's model has a free scale", 0.0)
    wanted: dict[tuple[Pose, Pose], int] = {}
    for each in found.sets:
        for key in set(map(_key, each.views)):
            wanted[key] = max(wanted.get(key, 0), sum(_key(view) == key for view in each.views))
    shots = {}
    for number, (key, repeats) in enumerate(wanted.items()):
        report("pictures", number, len(wanted))
        shots[key] = _shot(Picture.of(found.scene, *key), repeats, images, (seed, number), quality)
    report("pictures", len(wanted), len(wanted))
    told = [row for each in found.sets for row in _rows(found.scene, each, shots)]
    return judge(told, time.perf_counter() - began)


def _key(view: planner.View) -> tuple[Pose, Pose]:
    return view.sensor, view.light


def _shot(picture: Picture, repeats: int, images: int, seed: tuple[int, int], quality: Quality) -> _Shot:
    (clean, known), rng = propagated(picture, quality), np.random.default_rng(seed)
    size, where = max(1, _PIXELS // clean.size), measure.region_of_interest(picture, estimators=(GRADIENT.locator,))
    noise, counts = picture.scene.noise, batches(repeats * images, size)
    (values,) = remeasured(picture, (render.expose(clean, noise, rng, count, where) for count in counts))
    return _Shot(values.object.reshape(repeats, images, -1), known.covariance)


def _rows(scene, chosen: planner.ViewSet, shots: dict) -> Iterator[tuple[CheckedQuantity, np.ndarray]]:
    """The quantities of one set of pictures, each with its combined values (images,)."""
    times: dict[tuple[Pose, Pose], int] = {}
    values, covariances = [], []
    for view in chosen.views:
        shot, again = shots[_key(view)], times.get(_key(view), 0)
        times[_key(view)] = again + 1
        values.append(shot.values[again])
        covariances.append(np.diag(shot.covariance))
    both = chosen.combination
    stack = np.stack(values)
    weighted, jointly = both.weighted(stack), both.least_squares(stack)
    with np.errstate(invalid="ignore"):
        expected = np.where(both.used, both.weights**2 * np.stack(covariances), 0.0).sum(0)
    for m, forecast in enumerate(chosen.views[0].prediction.measurands):
        if not both.used[:, m].any():
            continue
        sample = Sample.of(weighted[:, m])
        n = sample.n - sample.failed
        ratio, interval = _ratio(sample, both.variances[m])
        ratio_jointly, interval_jointly = _ratio(Sample.of(jointly[:, m]), both.covariance_least_squares[m, m])
        yield CheckedQuantity(
            pictures=len(chosen.views), name=forecast.name, unit=forecast.unit, status=both.status[m],
            predicted=float(both.variances[m]), propagated=float(expected[m]),
            empirical=sample.variance if n > 1 else None, n=n, failed=sample.failed, ratio=ratio,
            ratio_interval=interval, ratio_least_squares=ratio_jointly, interval_least_squares=interval_jointly,
            bias=sample.mean - forecast.value_object if n else None,
            predicted_bias=float(both.bias[m]), judged=is_trusted(both.status[m]),
        ), weighted[:, m]  # fmt: skip


def _ratio(sample: Sample, predicted: float) -> tuple[float | None, tuple[float, float] | None]:
    """Sample variance over the predicted one, and its interval; None where there is none."""
    ratio = sample.ratio(predicted)
    return (None, None) if np.isnan(ratio) else (float(ratio), sample.interval(predicted))


def judge(told: list[tuple[CheckedQuantity, np.ndarray]], seconds: float) -> ViewsCheck:
    """The verdict about the rows that are to be judged; each comes with its combined values (images,)."""
    rows = tuple(row for row, _ in told)
    if not any(row.judged for row in rows):
        return ViewsCheck(
            rows, None, f"nothing that is measured is proven ({counted(r.status for r in rows)})", seconds
        )
    verdict = statistics.verdict(
        _column(rows, "ratio"), _column(rows, "n"), lost=_column(rows, "failed"), bias_px=_column(rows, "bias"),
        predicted_bias_px=_column(rows, "predicted_bias"), sigma_px=np.sqrt(_column(rows, "predicted")),
        status=[row.status for row in rows], independent=independent([values for row, values in told if row.judged]),
    )  # fmt: skip
    return ViewsCheck(rows, verdict, "", seconds)


def _column(rows: tuple[CheckedQuantity, ...], name: str) -> np.ndarray:
    """A number of each quantity, NaN where there is none."""
    return np.array([getattr(row, name) for row in rows], float)
