"""Prices of a setting that need no image: the paper's, the calibrated one in absolute px^2, and the bound.

Each finds how well the line of every edge is known, as a function V(A, B): the variance of A d + B theta, d the
line's displacement at the edge's first end (px) and theta its rotation (rad). `features.measurand` knows A and B.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.features.circles import calibrated_centre, fisher_centre, rim
from planner.features.measurand import Measurand, measurand
from planner.features.projected_edges import cut, end_depths, image_fractions
from planner.imaging.contrast import squared_contrast
from planner.imaging.projection import direction
from planner.imaging.visibility import longest_span
from planner.models.locator import MIN_CONTRAST, MIN_USABLE, correlation, information_bound, kappa2, reach
from planner.models.moments import moments
from scenes import Centre, Scene

PAPER_POINTS = 100  # points an edge (section 9.1)
PAPER_KAPPA2 = 8.697  # the paper's least-squares estimate of k (section 9.1)
NODES, NODE_WEIGHTS = np.polynomial.legendre.leggauss(16)

LineVariance = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Evaluated:
    """Predicted errors for arrays of settings of leading shape (...).

    Attributes
    ----------
    measurand : Measurand
        What is measured; its arrays have the sensors' leading shape.
    variance, variance_object : ndarray, shape (...)
        In the image (px^2, or rad^2 of an angle) and in the object (cm^2, or rad^2); infinite where it cannot be
        measured.
    line_variance : callable
        (A, B) of shape (..., E) to the variance of A d + B theta of each line, px^2.
    contrast : ndarray, shape (..., E)
        Root mean square contrast along each straight edge, grey levels.
    centres : tuple of ndarray, shape (..., 2, 2)
        Covariance of each circle's centre, px^2, in the order of the task's features; infinite diagonal where it
        cannot be found.
    """

    measurand: Measurand
    variance: np.ndarray
    variance_object: np.ndarray
    line_variance: LineVariance
    contrast: np.ndarray
    centres: tuple[np.ndarray, ...]


def paper(scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> Evaluated:
    """The paper's VarianceEvaluate (Fig. 8): eq. 8-10, 7, 3, 5, 6 as printed, slips repaired.

    100 points an edge, equally spaced in space, independent errors of variance 8.697 sigma^2 / C_i^2, no fall-off
    with distance; points that are hidden do not count. Its unit of intensity is not printed, so the result is right
    up to one factor for all settings.
    """
    sensors, lights = np.asarray(sensors, float), np.asarray(lights, float)
    known = measurand(scene, sensors)
    lengths, per_point = known.view.lengths, PAPER_KAPPA2 * scene.noise.sigma**2
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        total, mean, spread, count = moments(scene, known.view.names, sensors, lights, PAPER_POINTS)
        mean, spread, weight = mean * lengths, spread * lengths**2, total / per_point
        tilt = (spread + (count - 1) / weight) / (weight * spread**2)  # eq. 4 with sigma^2 = I / (I - 1) spread

    def line_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return a**2 * (1 + tilt) / weight + (b - a * mean) ** 2 * tilt

    def centre(circle) -> np.ndarray:
        return fisher_centre(circle, circle.squared / per_point, circle.counted)

    return _evaluated(scene, sensors, lights, known, line_variance, total / PAPER_POINTS, centre, fall_off=False)


def calibrated(scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> Evaluated:
    """Absolute px^2 from camera, exposure, blur, noise, image length and the locator's closed form.

    Edge points lie densely along the trimmed edge; their errors have variance kappa^2 s_n^2 / C^2 and correlation
    exp(-d^2 / (4 s^2)). With f(t) the weight that the least-squares line gives to an error at t in A d + B theta,
    the variance is the double integral of f f' sigma sigma' correlation: to second order
    2 sqrt(pi) s (integral of g^2 - s^2 integral of g'^2) - 2 s^2 (g^2 at both ends), g = f sigma; on an edge of less
    than 10 s the double integral itself. Where the contrast changes by more than a factor 2 along an edge (gloss, or
    another part of the object behind it), points below `MIN_CONTRAST` are dropped and the first order alone is taken.
    Infinite where an edge has too little contrast or length to be measured.
    """
    scale, noise = scene.locator.scale_px, scene.noise.variance
    per_point = kappa2(scale, scene.camera.blur_px) * noise
    along = _Along.of(scene, sensors, lights, trimmed=True)
    uniform = scene.solid.is_convex and scene.material.is_diffuse
    weak = (along.squared.mean(-1) < MIN_CONTRAST**2 * noise) | (along.length[..., 0] < MIN_USABLE)

    def line_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        a, lever, length = a[..., None], (b[..., None] - a[..., None] * along.middle), along.length
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            weight = (a + 12 * lever * along.t / length**2) / length
            g2 = weight**2 * per_point / along.squared
            slope2 = (12 * lever / length**3) ** 2 * per_point / along.squared
            inside = integral(g2 - scale**2 * slope2, length)
            variance = 2 * np.sqrt(np.pi) * scale * inside - 2 * scale**2 * (g2[..., 0] + g2[..., -1])
            short = np.broadcast_to(length[..., 0] < 10 * scale, variance.shape)
            if short.any():
                g, t, whole = (
                    np.broadcast_to(v, (*short.shape, v.shape[-1]))[short]
                    for v in (weight * np.sqrt(per_point / along.squared), along.t, length)
                )
                variance[short] = _double_integral(g, t, whole, scale)
            if not uniform:
                rough = along.squared.max(-1) > 4 * along.squared.min(-1)
                first_order = _first_order(along, a, lever, per_point, MIN_CONTRAST**2 * noise)
                variance = np.where(rough, 2 * np.sqrt(np.pi) * scale * first_order, variance)
        return np.where(weak, np.inf, variance)

    def centre(circle) -> np.ndarray:
        return calibrated_centre(circle, per_point, 2 * np.sqrt(np.pi) * scale, MIN_CONTRAST**2 * noise)

    return _evaluated(
        scene, sensors, lights, along.measurand, line_variance, along.squared.mean(-1), centre, fall_off=True
    )


def bound(scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> Evaluated:
    """Cramer-Rao bound: the smallest variance that any unbiased estimator can have.

    Information C^2 / (2 sqrt(pi) s_e s_n^2) per px of each whole visible edge about its offset and tilt.
    """
    noise, blur = scene.noise.variance, scene.camera.blur_px
    along = _Along.of(scene, sensors, lights, trimmed=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        density = information_bound(np.sqrt(along.squared), noise, blur)
        total, first, second = (integral(density * along.t**power, along.length) for power in (0, 1, 2))
        mean = first / total

    def line_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        lever = b - a * (along.middle[..., 0] + mean)
        return a**2 / total + lever**2 / (second - first * mean)

    def centre(circle) -> np.ndarray:
        return fisher_centre(circle, information_bound(np.sqrt(circle.squared), noise, blur) * circle.arc, None)

    return _evaluated(
        scene, sensors, lights, along.measurand, line_variance, along.squared.mean(-1), centre, fall_off=True
    )


@dataclass(frozen=True)
class _Along:
    """Gauss-Legendre nodes along the used part of the image of each edge, and the squared contrast there.

    ``t`` are positions from the middle of the used part (first end, nodes, last end), ``middle`` is that middle's
    distance from the edge's first end, ``length`` the used length: px, the last two with a last axis of size 1.
    """

    measurand: Measurand
    t: np.ndarray
    middle: np.ndarray
    length: np.ndarray
    squared: np.ndarray

    @classmethod
    def of(cls, scene: Scene, sensors: np.ndarray, lights: np.ndarray, *, trimmed: bool) -> _Along:
        sensors, lights = np.asarray(sensors, float), np.asarray(lights, float)
        known = measurand(scene, sensors)
        view = known.view
        whole = np.where(view.lengths > 0, view.lengths, np.nan)[..., None]  # an edge seen end-on has no direction
        trims = used_trims(scene, view, sensors, lights, trimmed=trimmed)
        length = whole - trims.sum(-1, keepdims=True)
        length = np.where(length > 0, length, np.nan)
        middle = trims[..., :1] + length / 2
        t = length / 2 * np.concatenate([[-1], NODES, [1]])
        near, far = end_depths(scene, view.names, sensors)
        fractions = (middle + t) / whole
        spatial = fractions * near / (far + fractions * (near - far))
        squared = squared_contrast(scene, view.names, spatial, sensors, lights, fall_off=True)
        return cls(known, t, middle, length, squared)


def used_trims(scene: Scene, view, sensors: np.ndarray, lights: np.ndarray, *, trimmed: bool) -> np.ndarray:
    """Lengths left out at both ends of each edge, px, shape (..., E, 2): trims, and what is hidden or in shadow."""
    trims = view.framed if trimmed else np.zeros_like(view.trims)
    if scene.solid.is_convex or not view.names:
        return trims
    positions = scene.camera.distance * direction(sensors), scene.light.distance * direction(lights)
    spans = [longest_span(scene.solid, scene.solid.edge(name), *positions) for name in view.names]
    shown = image_fractions(scene, view.names, sensors, np.stack(spans, -2))
    return cut(trims, shown, view.lengths, reach(scene.locator.scale_px, scene.camera.blur_px) if trimmed else 0.0)


def integral(values: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Integral along the edge of values at (first end, nodes, last end)."""
    return values[..., 1:-1] @ NODE_WEIGHTS * length[..., 0] / 2


def _first_order(along: _Along, a: np.ndarray, lever: np.ndarray, per_point: float, weakest: float) -> np.ndarray:
    """Integral of g^2 for the least-squares line through the points of enough squared contrast only."""
    t, squared = along.t[..., 1:-1], along.squared[..., 1:-1]
    kept = np.where(squared >= weakest, NODE_WEIGHTS * along.length / 2, 0.0)
    total = kept.sum(-1, keepdims=True)
    mean = (kept * t).sum(-1, keepdims=True) / total
    spread = (kept * (t - mean) ** 2).sum(-1, keepdims=True)
    weight = a / total + (lever - a * mean) * (t - mean) / spread
    variance = (kept * weight**2 * per_point / np.where(squared > 0, squared, np.inf)).sum(-1)
    return np.where((total[..., 0] >= MIN_USABLE) & (spread[..., 0] > 0), variance, np.inf)


def _double_integral(g: np.ndarray, t: np.ndarray, length: np.ndarray, scale: float) -> np.ndarray:
    """Integral of g(t) g(t') correlation(t - t') over both; never negative."""
    weighted, inner = g[..., 1:-1] * NODE_WEIGHTS * length / 2, t[..., 1:-1]
    kernel = correlation(inner[..., :, None] - inner[..., None, :], scale)
    return np.einsum("...i,...ij,...j->...", weighted, kernel, weighted)


def _evaluated(
    scene, sensors, lights, known: Measurand, line_variance, mean_square, centre_covariance, *, fall_off
) -> Evaluated:
    """From the lines' and the centres' errors to the measurand's."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        parts = line_variance(known.offset, known.tilt)
        usable = known.view.visible & np.isfinite(parts)
        variance = np.where(usable, parts, np.inf).sum(-1)
        centres = []
        for feature in scene.task.corners:
            if isinstance(feature, Centre):
                circle = rim(scene, scene.solid.circle(feature.circle), sensors, lights, fall_off=fall_off)
                covariance = centre_covariance(circle)
                moved = np.einsum("...i,...ij,...j->...", known.pull, covariance, known.pull)
                variance = variance + np.where(np.isfinite(moved), moved, np.inf)
                centres.append(covariance)
        variance = np.where(np.isfinite(variance) & np.isfinite(known.value), variance, np.inf)
        in_object = variance / known.scale**2
    in_object = np.where(np.isfinite(in_object), in_object, np.inf)
    return Evaluated(known, variance, in_object, line_variance, np.sqrt(mean_square), tuple(centres))
