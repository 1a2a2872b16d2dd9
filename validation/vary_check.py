"""Does another choice of polarisers, lamp or filter gain what is predicted? Noisy pictures of both plans tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtr, fdtrc, fdtri

import planner
import render
from planner import Chosen, Varied
from render import Quality
from scenes import Picture, status
from validation.defaults import DEFAULT_SEED
from validation.remeasured import Sample, propagated, remeasured
from validation.statistics import STRAY

LEVEL = 0.01  # probability of contradicting a prediction that is true
IMAGES = 1000


@dataclass(frozen=True)
class Scatter:
    """One plan, measured in noisy pictures of it.

    Attributes
    ----------
    measurand : str
        The quantity that limits the plan.
    predicted, propagated, measured : float
        Variance (not sigma) of that quantity, unit squared or px^2: without a picture, from the noise-free picture, and
        of the noisy ones; NaN where there is none.
    share : float
        What a variance is multiplied with in what is minimised.
    n, failed : int
        Pictures, and those that could not be measured.
    interval : pair of float
        Two-sided 95 % chi-square interval of the true variance.
    status : str
        The worst in the noise-free picture.
    """

    measurand: str
    predicted: float
    propagated: float
    measured: float
    share: float
    n: int
    failed: int
    interval: tuple[float, float]
    status: str


@dataclass(frozen=True)
class VaryCheck:
    """The scatter of both plans, and the gain.

    Attributes
    ----------
    fixed, best : Scatter
    gain, predicted_gain : float
        Ratio of the two variances (each times its share), measured and predicted.
    interval : pair of float
        Two-sided 95 % F interval of the true ratio.
    p_value : float
        Two-sided F test of the predicted gain being the true one; NaN where a plan cannot be measured.
    verdict : str
        Begins with "agree" or "contradict".
    """

    fixed: Scatter
    best: Scatter
    gain: float
    predicted_gain: float
    interval: tuple[float, float]
    p_value: float
    verdict: str

    @property
    def agrees(self) -> bool:
        return self.verdict.startswith("agree")


def check_varied(
    found: planner.Plan, images: int = IMAGES, quality: Quality = Quality(), seed: int = DEFAULT_SEED,
    report: Callable[[str, int, int], None] = lambda *_: None,
) -> VaryCheck:  # fmt: skip
    """Render the fixed and the varied plan and measure both in noisy pictures.

    Parameters
    ----------
    found : Plan
        With ``varied``.
    images : int
        Noisy pictures of each.
    quality : Quality
        Rays a pixel.
    seed : int
        Root of the noise.
    report : callable, optional
        Called with what is done, how many are done, and of how many.
    """
    rows, streams = [], np.random.default_rng(seed).spawn(2)
    for done, (chosen, rng) in enumerate(zip((found.varied.fixed, found.varied.best), streams, strict=True)):
        report("plans", done, 2)
        rows.append(_scatter(found, chosen, images, quality, rng))
    report("plans", 2, 2)
    return judged(*rows, same=_same(found.varied))


def _same(varied: Varied) -> bool:
    """Whether nothing is gained: both plans are one."""
    one, two = varied.fixed, varied.best
    return (one.choice, one.sensor, one.light) == (two.choice, two.sensor, two.light)


def _scatter(found: planner.Plan, chosen: Chosen, images: int, quality: Quality, rng: np.random.Generator) -> Scatter:
    scene, in_object = chosen.scene, found.objective == "object"
    aim = planner.Aim.of(scene.quantities, found.objective, found.over)
    told = planner.predict(scene, chosen.sensor, chosen.light, found.model).measurands
    predicted = np.array([e.variance_object if in_object else e.variance_image for e in told])
    worst = int(np.argmax(predicted * aim.shares))
    picture = Picture.of(scene, chosen.sensor, chosen.light)
    clean, known = propagated(picture, quality)
    (seen,) = remeasured(picture, [render.expose(clean, scene.noise, rng, images)])
    sample = Sample.of((seen.object if in_object else seen.image)[:, worst])
    variance = float(np.diag(known.covariance if in_object else known.covariance_image)[worst])
    return Scatter(
        measurand=told[worst].name,
        predicted=float(predicted[worst]),
        propagated=variance if np.isfinite(variance) else float("nan"),
        measured=sample.variance,
        share=float(aim.shares[worst]),
        n=images,
        failed=sample.failed,
        interval=sample.interval(1.0),
        status=str(known.status[worst]),
    )


def judged(fixed: Scatter, best: Scatter, *, same: bool = False) -> VaryCheck:
    """The gain that two scatters show, beside the predicted one.

    Under the prediction (s_1^2 / v_1) / (s_2^2 / v_2) follows F(n_1 - 1, n_2 - 1).

    Parameters
    ----------
    same : bool
        Whether both are one plan, so that there is no gain to be judged but 1.
    """
    predicted = fixed.predicted * fixed.share / (best.predicted * best.share)
    lost = [row for row in (fixed, best) if not row.failed <= STRAY * row.n or not row.measured > 0]
    if lost:
        text = f"contradict: {lost[0].failed} of {lost[0].n} pictures could not be measured."
        return VaryCheck(fixed, best, float("nan"), predicted, (0.0, float("inf")), float("nan"), text)
    gain = fixed.measured * fixed.share / (best.measured * best.share)
    freedoms = [row.n - row.failed - 1 for row in (fixed, best)]
    ends = tuple(float(gain / fdtri(*freedoms, p)) for p in (0.975, 0.025))
    p_value = float(min(1.0, 2 * min(law(*freedoms, gain / predicted) for law in (fdtr, fdtrc))))
    doubtful = [row.status for row in (fixed, best) if not status.is_trusted(row.status)]
    if p_value < LEVEL:
        said = "contradict: the measured gain is not the predicted one"
    elif doubtful:
        said = f"contradict: the gain is not proven, for the values are not: {status.counted(doubtful)}"
    elif same:
        said = "agree: nothing is gained, both plans are one"
    else:
        said = "agree: the measured gain is the predicted one"
    text = f"{said} (F test, p-value {p_value:.2g}, level {LEVEL:g})."
    return VaryCheck(fixed, best, gain, predicted, ends, p_value, text)
