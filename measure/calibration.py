"""What an edge locator makes of noise, measured: the paper's Fig. 1 for each of ours.

Straight edges at several angles, exactly blurred, in white noise. For the point locators the variance of an edge
point is kappa^2 (s_n / C)^2 while the noise is small, and neighbouring points' errors are correlated; for a line only
kappa^2 times the correlation length counts, and that product is what can be compared with the Cramer-Rao bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from imaging.features.locator import information_bound, kappa2
from imaging.models.paper import PAPER_KAPPA2
from measure.estimators.coverage import NODE_WEIGHTS, NODES, half_plane
from measure.estimators.kinds import ESTIMATORS
from measure.estimators.registry import estimator
from measure.estimators.separate import SeparateEstimator
from measure.features.layout import Layout, polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape
from scenes import Scene, status

RATIOS = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5)
ANGLES = (0.0, 11.0, 22.5, 37.0)
_POINTS = ("canny", "gradient", "isophote")  # estimators by edge points
_SIDE, _SIZE = 60.0, 96  # px: of the square, and of the image
_CONTRAST = 100.0  # grey levels; only noise over contrast matters
_SMALL = 0.1  # noise over contrast up to which the law is fitted
_LINEAR = 0.15  # relative departure of a variance from kappa^2 (s_n / C)^2 at which linearity has ended


@dataclass(frozen=True, eq=False)
class Curve:
    """One locator.

    Attributes
    ----------
    name : str
    ratios : ndarray
        Noise over contrast.
    sigma_px : ndarray
        Standard deviation of an edge point across the edge (for likelihood estimators: of the line's offset, times the
        root of the edge's length over the correlation length of `gradient`), px; NaN where nothing was found.
    floor_px : float
        What is left without noise: the error of the points' places within a pixel, px.
    kappa2 : float
        Fitted together with it over the smaller ratios.
    correlation_px : float
        Integral of the correlation along the edge, px.
    linear_to : float
        Largest noise over contrast at which the variance is still as fitted.
    efficiency : float
        Bound over kappa^2 times correlation length: 1 at the Cramer-Rao bound.
    """

    name: str
    ratios: np.ndarray
    sigma_px: np.ndarray
    floor_px: float
    kappa2: float
    correlation_px: float
    linear_to: float
    efficiency: float


@dataclass(frozen=True)
class Calibration:
    """All curves of a scene's optics, with the closed form, the bound and the paper's number beside them."""

    scene: str
    blur_px: float
    scale_px: float
    curves: tuple[Curve, ...]
    closed_kappa2: float
    closed_correlation_px: float
    bound: float
    paper_kappa2: float


def calibrate(scene: Scene, images: int, seed: int, progress=lambda *_: None) -> Calibration:
    """Measure every locator at the scene's blur and smoothing scale.

    Parameters
    ----------
    scene : Scene
    images : int
        Noisy images for each angle and each ratio; a variance then has a relative standard error of about
        sqrt(2 / (4 angles x images x independent points)).
    seed : int
    progress : callable
        Called as progress(what, done, total).
    """
    rng = np.random.default_rng(seed)
    blur, scale = scene.camera.blur_px, scene.locator.scale_px
    bound = 1 / float(information_bound(np.array(1.0), 1.0, blur))
    curves = []
    for name in ESTIMATORS:
        variances = []
        for k, ratio in enumerate(RATIOS):
            progress("levels", len(curves) * len(RATIOS) + k, len(ESTIMATORS) * len(RATIOS))
            variances.append(_variance(name, ratio, scene, images, rng))
        curves.append(_curve(name, np.array(variances), scene, bound))
    progress("levels", 1, 1)
    closed = kappa2(scale, blur)
    return Calibration(scene.name, blur, scale, tuple(curves), closed, 2 * np.sqrt(np.pi) * scale, bound, PAPER_KAPPA2)


def _variance(name: str, ratio: float, scene: Scene, images: int, rng) -> tuple[float, float]:
    """Variance of an edge point, px^2, and correlation length, px, at unit contrast and noise ``ratio``."""
    points, lengths = [], []
    for degrees in ANGLES:
        clean, layout = _square(degrees, ratio, scene)
        noisy = clean + _CONTRAST * ratio * rng.standard_normal((images, *clean.shape))
        found = _points(noisy, layout, name) if name in _POINTS else _lines(noisy, layout, name)
        if found is not None:
            points.append(found[0])
            lengths.append(found[1])
    if len(points) < len(ANGLES):
        return float("nan"), float("nan")
    return float(np.mean(points)), float(np.mean(lengths))


def _square(degrees: float, ratio: float, scene: Scene) -> tuple[np.ndarray, Layout]:
    """Image of a turned square far larger than the blur, and its layout."""
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * _SIDE / 2 @ turn.T + _SIZE / 2 + np.array([0.3, 0.7])
    optics = Optics(
        (_SIZE, _SIZE), scene.camera.blur_px, (_CONTRAST * ratio) ** 2, scene.locator.scale_px, scene.locator.window_px
    )
    return _CONTRAST * _covered(corners.tobytes(), scene.camera.blur_px), polygon_layout(corners, optics)


@lru_cache(maxsize=8)
def _covered(square: bytes, blur: float) -> np.ndarray:
    """Part of each pixel that a square of corners (4, 2) covers."""
    corners = np.frombuffer(square).reshape(4, 2)
    y, x = np.mgrid[:_SIZE, :_SIZE]
    nodes = np.stack([x, y], -1)[..., None, :] + NODES
    covered = np.ones((_SIZE, _SIZE, len(NODES)))
    for start, stop in zip(corners, np.roll(corners, -1, 0), strict=True):
        along = (stop - start) / _SIDE
        inward = np.array([-along[1], along[0]])
        covered = covered * half_plane((nodes - start) @ inward / max(blur, 0.3))
    return (covered * NODE_WEIGHTS).sum(-1)


def _points(noisy: np.ndarray, layout: Layout, name: str) -> tuple[float, float] | None:
    """Pooled variance of edge points, and the correlation length that the variance of their mean tells."""
    tool: SeparateEstimator = estimator(layout, name, 0.15 * _CONTRAST)
    variances, lengths = [], []
    for part in tool.parts:
        found = part.locator.locate(noisy)
        span = part.caliper.positions[-1] - part.caliper.positions[0]
        if found.valid.sum(1).mean() < 0.98 * (part.caliper.positions.size if name != "canny" else span / np.sqrt(2)):
            return None
        weight = found.valid / found.valid.sum(1, keepdims=True)
        mean = (weight * found.offset).sum(1)
        centre = (found.offset * found.valid).sum() / found.valid.sum()
        each = ((found.offset - centre) ** 2 * found.valid).sum() / found.valid.sum()
        variances.append(each)
        spacing = span / max(found.valid.sum(1).mean() - 1, 1)
        lengths.append(mean.var(ddof=1) * (span + spacing) / each)
    return float(np.mean(variances)), float(np.mean(lengths))


def _lines(noisy: np.ndarray, layout: Layout, name: str) -> tuple[float, float] | None:
    """Variance of the side's middle, told as that of points one correlation length of `gradient` apart."""
    shape = find_shape(noisy, layout, name, judged=False)
    if np.mean(np.isin(shape.status, status.MEASURED)) < 0.98:
        return None
    middle = layout.ends.mean(1)
    offsets = np.einsum("nei,nei->ne", shape.normals, middle - shape.points)
    correlation = 2 * np.sqrt(np.pi) * layout.optics.scale_px
    used = _SIDE
    return float(np.nanvar(offsets, axis=0, ddof=1).mean() * used / correlation), float(correlation)


def _curve(name: str, found: np.ndarray, scene: Scene, bound: float) -> Curve:
    """Fit variance = floor^2 + kappa^2 (s_n / C)^2 to the smaller ratios, then see how far it holds."""
    ratios, variance, length = np.array(RATIOS), found[:, 0], found[:, 1]
    small = (ratios <= _SMALL) & np.isfinite(variance)
    if small.sum() < 3:
        return Curve(name, ratios, np.sqrt(variance), *[float("nan")] * 5)
    design = np.stack([np.ones(small.sum()), ratios[small] ** 2], 1)
    weight = 1 / variance[small]  # sampling errors are a constant part of a variance
    floor, fitted = np.linalg.lstsq(design * weight[:, None], variance[small] * weight, rcond=None)[0]
    quiet = small & (fitted * ratios**2 > 4 * floor)
    correlation = float(np.mean(length[quiet if quiet.any() else small]))
    holds = np.abs(variance / (floor + fitted * ratios**2) - 1) < _LINEAR
    ends = np.flatnonzero(~holds & (ratios > ratios[small][0]))
    linear_to = float(ratios[ends[0] - 1]) if ends.size else float(ratios[-1])
    efficiency = bound / (fitted * correlation)
    return Curve(
        name,
        ratios,
        np.sqrt(variance),
        float(np.sqrt(max(floor, 0))),
        float(fitted),
        correlation,
        linear_to,
        efficiency,
    )


def blur_for(kappa2_wanted: float, scale: float) -> float:
    """Lens blur, px, at which the zero crossing of scale s has a given kappa^2: what the paper's 8.697 would mean."""
    ratio = (8 * kappa2_wanted / 3) ** (1 / 3) - 1
    edge = scale * np.sqrt(max(ratio, 0.0))
    return float(np.sqrt(max(edge**2 - 1 / 12, 0.0)))
