"""Two prices of a setting that need no image: the paper's, and the calibrated one in absolute px^2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.contrast import contrast, side_levels
from planner.locator import MIN_CONTRAST, MIN_USABLE, correlation, information_bound, kappa2
from planner.outline import Outline, outline
from planner.propagation import corner_covariance, distance_variance, fit_line, offset_variance
from planner.view import depth, edge_points, project
from scenes import Scene

PAPER_POINTS = 100  # points an edge (section 9.1)
PAPER_KAPPA2 = 8.697  # the paper's least-squares estimate of k (section 9.1)
_NODES, _NODE_WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Priced:
    """Predicted errors for arrays of settings of leading shape (...).

    Attributes
    ----------
    variance : ndarray, shape (...)
        Of the measured distance, px^2; infinite where it cannot be measured.
    ends : ndarray, shape (..., 2, 2)
        The two corners (x, y), px.
    covariances : ndarray, shape (..., 2, 2, 2)
        Of the two corners, px^2.
    contrast : ndarray, shape (..., E)
        Root mean square contrast along each required edge, grey levels.
    view : Outline
        The required edges in the image; its arrays have the sensors' leading shape.
    """

    variance: np.ndarray
    ends: np.ndarray
    covariances: np.ndarray
    contrast: np.ndarray
    view: Outline


def paper(scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> Priced:
    """The paper's VarianceEvaluate (Fig. 8): eq. 8-10, 7, 3, 5, 6 as printed, slips repaired.

    100 points an edge, equally spaced in space, independent errors of variance 8.697 sigma^2 / C_i^2, no fall-off
    with distance. Its unit of intensity is not printed, so the result is right up to one factor for all settings.
    """
    sensors, lights = np.asarray(sensors, float), np.asarray(lights, float)
    view = outline(scene, sensors)
    points = edge_points(scene.solid, view.names, np.linspace(0, 1, PAPER_POINTS))
    image = project(points.reshape(-1, 3), sensors, scene.camera).reshape(*sensors.shape[:-1], *points.shape[:-1], 2)
    steps = contrast(side_levels(scene, view.names, points, sensors, lights, fall_off=False))
    fit = fit_line(image, steps**2 / (PAPER_KAPPA2 * scene.noise.sigma**2))
    ends = _corners(scene, view)
    offsets = offset_variance(fit, ends.repeat(2, axis=-2))
    return _assemble(view, ends, fit.normal, offsets, steps)


def calibrated(scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> Priced:
    """Absolute px^2 from camera, exposure, blur, noise, image length and the locator's closed form.

    Edge points lie densely along the trimmed edge; their errors have variance kappa^2 s_n^2 / C^2 and correlation
    exp(-d^2 / (4 s^2)). With f(t) the weight that the least-squares line gives to an error at t in its own position at
    the corner, the variance there is the double integral of f f' sigma sigma' correlation: to second order
    2 sqrt(pi) s (integral of g^2 - s^2 integral of g'^2) - 2 s^2 (g^2 at both ends), g = f sigma; on an edge of less
    than 10 s the double integral itself. Infinite where an edge has too little contrast or length to be measured.
    """
    scale, blur = scene.locator.scale_px, scene.camera.blur_px
    per_point = kappa2(scale, blur) * scene.noise.variance

    def offsets(t: np.ndarray, steps: np.ndarray, length: np.ndarray, corner: np.ndarray) -> np.ndarray:
        weight = (1 + 12 * corner * t / length**2) / length
        with np.errstate(divide="ignore", invalid="ignore"):
            g = weight * np.sqrt(per_point) / steps
        slope = 12 * corner / length**3 * np.sqrt(per_point) / steps
        inside = _integral(g**2 - (scale * slope) ** 2, length)
        ends = g[..., 0] ** 2 + g[..., -1] ** 2
        smooth = 2 * np.sqrt(np.pi) * scale * inside - 2 * scale**2 * ends
        variance = np.where(length[..., 0] < 10 * scale, _double_integral(g, t, length, scale), smooth)
        weak = (steps**2).mean(-1) < MIN_CONTRAST**2 * scene.noise.variance
        return np.where(weak | (length[..., 0] < MIN_USABLE), np.inf, variance)

    return _along_edges(scene, sensors, lights, offsets, trimmed=True)


def bound(scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> Priced:
    """Cramer-Rao bound: the smallest variance that any unbiased estimator can have.

    Information C^2 / (2 sqrt(pi) s_e s_n^2) per px of each whole edge about its offset and tilt, nothing trimmed.
    """

    def offsets(t: np.ndarray, steps: np.ndarray, length: np.ndarray, corner: np.ndarray) -> np.ndarray:
        density = information_bound(steps, scene.noise.variance, scene.camera.blur_px)
        total, first, second = (_integral(density * t**power, length) for power in (0, 1, 2))
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = first / total
            return 1 / total + (corner[..., 0] - mean) ** 2 / (second - first * mean)

    return _along_edges(scene, sensors, lights, offsets, trimmed=False)


def _along_edges(scene, sensors, lights, offset_variance_at_corner, *, trimmed: bool) -> Priced:
    """Price from the contrast at Gauss-Legendre nodes along the image of each edge.

    ``offset_variance_at_corner(t, contrast, length, corner)`` gets positions t along the edge (px, from the middle
    of its used part) with a last axis of nodes; length and corner have that axis with size 1.
    """
    sensors, lights = np.asarray(sensors, float), np.asarray(lights, float)
    view = outline(scene, sensors)
    ends = _corners(scene, view)
    start = view.ends[..., 0, :]
    whole = np.where(view.lengths > 0, view.lengths, np.nan)[..., None]  # an edge seen end-on has no direction
    along = (view.ends[..., 1, :] - start) / whole
    trims = view.trims if trimmed else np.zeros_like(view.trims)
    length = np.where(whole > trims.sum(-1, keepdims=True), whole - trims.sum(-1, keepdims=True), np.nan)
    middle = trims[..., :1] + length / 2
    t = length / 2 * np.concatenate([[-1], _NODES, [1]])
    corner = np.einsum("...ei,...ei->...e", ends.repeat(2, axis=-2) - start, along)[..., None] - middle
    steps = _contrast_along(scene, view, sensors, lights, (middle + t) / whole)
    with np.errstate(divide="ignore", invalid="ignore"):
        offsets = offset_variance_at_corner(t, steps, length, corner)
    normals = np.stack([-along[..., 1], along[..., 0]], -1)
    return _assemble(view, ends, normals, offsets, steps)


def _contrast_along(scene, view, sensors, lights, fractions):
    """Contrast at fractions of each edge's IMAGE length, shape (..., E, n)."""
    ends = edge_points(scene.solid, view.names, np.array([0.0, 1.0]))
    near, far = np.moveaxis(depth(ends, sensors[..., None, :], scene.camera), -1, 0)[..., None]
    spatial = fractions * near / (far + fractions * (near - far))
    points = edge_points(scene.solid, view.names, spatial)
    return contrast(side_levels(scene, view.names, points, sensors, lights, fall_off=True))


def _integral(values: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Integral along the edge of values at (first end, nodes, last end)."""
    return (values[..., 1:-1] * _NODE_WEIGHTS).sum(-1) * length[..., 0] / 2


def _double_integral(g: np.ndarray, t: np.ndarray, length: np.ndarray, scale: float) -> np.ndarray:
    """Integral of g(t) g(t') correlation(t - t') over both; never negative."""
    weighted, inner = g[..., 1:-1] * _NODE_WEIGHTS * length / 2, t[..., 1:-1]
    kernel = correlation(inner[..., :, None] - inner[..., None, :], scale)
    return np.einsum("...i,...ij,...j->...", weighted, kernel, weighted)


def _corners(scene: Scene, view: Outline) -> np.ndarray:
    """Images of the two corners, px, shape (..., 2, 2)."""
    found = []
    for k, corner in enumerate(scene.task.corners):
        edge = scene.solid.edge(corner.edges[0])
        found.append(view.ends[..., 2 * k, edge.ends.index(scene.solid.vertex_names.index(corner.vertex)), :])
    return np.stack(found, -2)


def _assemble(view: Outline, ends, normals, offsets, steps) -> Priced:
    """From line offsets' variances at the corners (..., E) to the distance."""
    offsets = np.where(np.isfinite(offsets) & view.visible, offsets, np.inf)
    pairs = normals.reshape(*normals.shape[:-2], 2, 2, 2), offsets.reshape(*offsets.shape[:-1], 2, 2)
    covariances = corner_covariance(*pairs)
    variance = distance_variance(ends, covariances)
    return Priced(variance, ends, covariances, np.sqrt((steps**2).mean(-1)), view)
