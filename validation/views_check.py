"""Do several planned pictures together measure as precisely as predicted? Each is rendered, and measured many times."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

import measure
import planner
import render
from measure import Correction
from render import Quality
from scenes import Picture, status
from scenes.status import counted, is_trusted
from validation import simulation, statistics
from validation.batch.measurands import independent
from validation.defaults import DEFAULT_SEED
from validation.remeasured import GRADIENT, Sample, batches, remeasured

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
        empirical / predicted (propagated, where the plan doubts it), and its 95 % chi-square interval; the same of the
        least-squares combination.
    ratio_least_squares : float or None
    bias : float or None
        Mean of the corrected values less the object's.
    correction, u_bias : float
        What was taken off, by the plan's weights, as renders of other rays tell it, and its standard uncertainty;
        infinite where it is not known.
    render_noise : float
        Standard deviation of ``bias`` by the renderer's own noise.
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
    correction: float
    u_bias: float
    render_noise: float
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
    """A picture measured: values (repeats, images, M) less their bias, the noise-free picture's joint covariance
    (M, M), and what was taken off."""

    values: np.ndarray
    covariance: np.ndarray
    off: Correction


def check_views(
    found: planner.Views,
    images: int = IMAGES,
    seed: int = DEFAULT_SEED,
    quality: Quality = Quality(),
    report: Callable[[str, int, int], None] = lambda *_: None,
) -> ViewsCheck:
    """Render every picture of a plan, add noise many times, measure, combine by the plan's weights, and compare.

    Pictures that a set has several times get noise of their own each time. Biases are taken off as renders of other
    rays tell them; a quantity's status is what that leaves of its combination (`scenes.status.corrected`).

    Parameters
    ----------
    found : Views
    images : int
        Noisy images of each picture.
    """
    began = time.perf_counter()
    if found.model == "paper":
        return ViewsCheck((), None, "the paper's model has a free scale", 0.0)
    wanted, pictures = Counter(), {}
    for each in found.sets:
        wanted |= Counter(view.place for view in each.views)
        pictures |= {view.place: view.picture for view in each.views}
    shots = {}
    for number, (place, repeats) in enumerate(wanted.items()):
        report("pictures", number, len(wanted))
        shots[place] = _shot(pictures[place], repeats, images, (seed, number), quality)
    report("pictures", len(wanted), len(wanted))
    told = [row for each in found.sets for row in _rows(each, shots)]
    return judge(told, time.perf_counter() - began)


def _shot(picture: Picture, repeats: int, images: int, seed: tuple[int, int], quality: Quality) -> _Shot:
    rng, how = np.random.default_rng(seed), simulation.How(quality)
    renders = simulation.steadied(picture, how.image(picture), GRADIENT, how)
    clean = renders.mean(picture)
    known = measure.propagate(clean, picture, estimator=GRADIENT.locator).measurands
    (off,) = simulation.independent(picture, (GRADIENT,), renders, (known,), how)
    size, where = max(1, _PIXELS // clean.size), measure.region_of_interest(picture, estimators=(GRADIENT.locator,))
    noise, counts = picture.scene.noise, batches(repeats * images, size)
    (values,) = remeasured(picture, (render.expose(clean, noise, rng, count, where) for count in counts))
    return _Shot(values.object.reshape(repeats, images, -1) - np.nan_to_num(off.bias), known.covariance, off)


def _rows(chosen: planner.ViewSet, shots: dict) -> Iterator[tuple[CheckedQuantity, np.ndarray]]:
    """The quantities of one set of pictures, each with its combined values (images,)."""
    times: Counter = Counter()
    values, own = [], [shots[view.place] for view in chosen.views]
    for view, shot in zip(chosen.views, own, strict=True):
        values.append(shot.values[times[view.place]])
        times[view.place] += 1
    both, stack = chosen.combination, np.stack(values)
    weighted, jointly = both.weighted(stack), both.least_squares(stack)
    with np.errstate(invalid="ignore"):
        noise = np.stack([np.diag(shot.covariance) for shot in own])
        expected = np.where(both.used, both.weights**2 * noise, 0.0).sum(0)
    off = _taken_off(chosen, own)
    for m, forecast in enumerate(chosen.views[0].prediction.measurands):
        if not both.used[:, m].any():
            continue
        sample = Sample.of(weighted[:, m])
        n = sample.n - sample.failed
        known = float(both.variances[m] if is_trusted(both.status[m]) else expected[m])
        ratio, interval = _ratio(sample, known)
        ratio_jointly, interval_jointly = _ratio(Sample.of(jointly[:, m]), both.covariance_least_squares[m, m])
        half = 0.0 if forecast.tolerance is None else forecast.tolerance.half
        told = status.worst(*(shot.off.simulated[m] for shot, used in zip(own, both.used[:, m], strict=True) if used))
        state = status.corrected(told, told, float(off["u_bias"][m]), math.sqrt(known), half)
        yield CheckedQuantity(
            pictures=len(chosen.views), name=forecast.name, unit=forecast.unit, status=state,
            predicted=float(both.variances[m]), propagated=float(expected[m]),
            empirical=sample.variance if n > 1 else None, n=n, failed=sample.failed, ratio=ratio,
            ratio_interval=interval, ratio_least_squares=ratio_jointly, interval_least_squares=interval_jointly,
            bias=sample.mean - forecast.value_object if n else None, judged=is_trusted(state),
            **{name: float(column[m]) for name, column in off.items()},
        ), weighted[:, m]  # fmt: skip


def _taken_off(chosen: planner.ViewSet, own: list[_Shot]) -> dict[str, np.ndarray]:
    """Of each quantity (M,), by the plan's weights: correction, its standard uncertainty, and the renderer's noise.

    What is not known of a part or of lamps moves all pictures alike, so uncertainties add; noise of renders does where
    they are the same one.
    """
    weights = np.where(chosen.combination.used, chosen.combination.weights, 0.0)

    def summed(columns: Iterable[np.ndarray]) -> np.ndarray:
        return np.where(weights > 0, weights * np.stack(list(columns)), 0.0).sum(0)

    with np.errstate(invalid="ignore"):
        square = np.zeros(weights.shape[1])
        for place in {view.place for view in chosen.views}:
            alike = [view.place == place for view in chosen.views]
            whole = weights[alike].sum(0)
            square += np.where(whole > 0, (whole * own[alike.index(True)].off.beside) ** 2, 0.0)
        return {
            "correction": summed(np.nan_to_num(shot.off.bias) for shot in own),
            "u_bias": summed(shot.off.u_bias for shot in own),
            "render_noise": np.sqrt(square),
        }


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
        sigma_px=np.sqrt(_column(rows, "predicted")), u_bias_px=_column(rows, "u_bias"),
        render_noise_px=_column(rows, "render_noise"),
        status=[row.status for row in rows], independent=independent([values for row, values in told if row.judged]),
    )  # fmt: skip
    return ViewsCheck(rows, verdict, "", seconds)


def _column(rows: tuple[CheckedQuantity, ...], name: str) -> np.ndarray:
    """A number of each quantity, NaN where there is none."""
    return np.array([getattr(row, name) for row in rows], float)
