"""The calibrated variance model: absolute, from the image model and the gradient locator's closed form."""

from __future__ import annotations

import numpy as np

from imaging.features.circles import calibrated_circle
from imaging.features.locator import MIN_CONTRAST, MIN_USABLE, correlation, kappa2
from imaging.features.measurand import normals
from imaging.light.appearance import is_separable
from imaging.models.along import NODE_WEIGHTS, Along, EdgeNodes
from imaging.models.errors import Errors, LineVariance, combined
from imaging.models.strong import ROUGH
from imaging.pictures import Pictures
from imaging.row_noise import of_lines, of_points

SHORT = 10.0  # smoothing scales: shorter edges take the double integral


def calibrated(pictures: Pictures) -> Errors:
    """Absolute px^2 from camera, exposure, blur, noise, image length and the locator's closed form.

    Edge points lie densely along the trimmed edge; their errors have variance kappa^2 s_n^2 / C^2, s_n^2 the mean of
    both sides' noise, and correlation exp(-d^2 / (4 s^2)). With f(t) the weight that the least-squares line gives to an
    error at t in A d + B theta, the variance is the double integral of f f' sigma sigma' correlation:
    2 sqrt(pi) s integral of g^2 - 2 s^2 (g^2 at both ends) + 8/3 s^4 g'^2, g = f sigma, exact for a linear g on a long
    edge; on an edge of less than 10 s the double integral itself. Where the contrast changes by more than a factor 2
    along an edge (gloss, or another part of the object behind it), points below `MIN_CONTRAST` are dropped and the
    first order alone is taken. What rows and columns of pixels share is added (`imaging.row_noise`). Infinite where an
    edge has too little contrast or length to be measured. Errors are found where the lens records the edge; its local
    magnification takes them to ideal px.
    """
    return pictures.once("calibrated", lambda: _calibrated(pictures))


def _calibrated(pictures: Pictures) -> Errors:
    scene, scale = pictures.scene, pictures.scene.locator.scale_px
    along = Along.of(pictures, trimmed=True)
    nodes, squared = along.nodes, along.squared
    noise = along.noise_variance * np.ones(1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        per_point = point_variance(nodes, scale) * noise / squared
        weak = (squared / noise).mean(-1) < MIN_CONTRAST**2
    weak |= nodes.length[..., 0] < MIN_USABLE

    def line_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            weight = line_weight(nodes, a, b)
            variance = (long_edge(nodes, weight, line_slope(nodes, a, b), scale) * per_point).sum(-1)
            short = np.broadcast_to(nodes.length[..., 0] < SHORT * scale, variance.shape)
            if short.any():
                variance[short] = _double_integral(*_picked(nodes, weight * np.sqrt(per_point), short), scale)
            if not is_separable(scene):
                rough = squared.max(-1) > ROUGH * squared.min(-1)
                if rough.any():
                    first_order = _first_order(nodes, a, b, per_point, squared >= MIN_CONTRAST**2 * noise)
                    variance = np.where(rough, 2 * np.sqrt(np.pi) * scale * first_order, variance)
            if scene.noise.is_shared:
                variance = variance + _of_shared(pictures, along, a, b)
        return np.where(weak, np.inf, variance)

    def found(circle) -> np.ndarray:
        noise, shared = scene.noise, None
        if noise.is_shared:
            shared = of_points(noise, circle.place, circle.normal, circle.arc, circle.blur, scale)
        return calibrated_circle(circle, kappa2(scale, circle.blur), scale, MIN_CONTRAST**2, shared)

    return combined(pictures, _quadratic(line_variance, nodes), squared.mean(-1), noise.mean(-1), found)


def _quadratic(variance: LineVariance, nodes: EdgeNodes) -> LineVariance:
    """The same, from three of them: variances of A d + B theta are quadratic in A and B."""
    length = nodes.length[..., 0]
    one, none = np.ones(length.shape), np.zeros(length.shape)
    moved, turned, both = (variance(*each) for each in ((one, none), (none, length), (one, length)))
    with np.errstate(invalid="ignore"):
        mixed = both - moved - turned

    def of(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            turn = b / length
            found = a * (a * moved + turn * mixed) + turn**2 * turned
        return np.where(np.isfinite(found), found, np.inf)

    return of


def _of_shared(pictures: Pictures, along: Along, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """What noise that rows and columns share adds to the variance of each line (..., E), at its mean contrast."""
    scene, nodes = pictures.scene, along.nodes
    blur, across = (np.mean(part * np.ones(1), -1) for part in (nodes.blur, nodes.across))
    length, slope = nodes.length[..., 0], line_slope(nodes, a, b)[..., 0]
    added = of_lines(
        scene.noise, a / length, slope, length, normals(along.measurands.view), blur, scene.locator.scale_px
    )
    return added * across**2 / along.squared.mean(-1)


def point_variance(nodes: EdgeNodes, scale: float) -> np.ndarray | float:
    """Variance of an edge point's offset in ideal px at unit noise and unit contrast."""
    return kappa2(scale, nodes.blur) * np.square(nodes.across)


def line_weight(nodes: EdgeNodes, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """f(t): what an error at t adds to A d + B theta of the least-squares line, (..., E, n)."""
    return (a[..., None] + line_slope(nodes, a, b) * nodes.length * nodes.t) / nodes.length


def line_slope(nodes: EdgeNodes, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Its derivative by t, (..., E, 1)."""
    return 12 * (b[..., None] - a[..., None] * nodes.middle) / nodes.length**3


def long_edge(nodes: EdgeNodes, weight: np.ndarray, slope: np.ndarray, scale: float) -> np.ndarray:
    """Coefficients, (..., E, n), with which the points' variances add up to a long edge's line's.

    The smoothing scale is that of recorded px: along the edge it spans scale / along ideal px.
    """
    inside = np.concatenate([[0], NODE_WEIGHTS, [0]]) * nodes.length / 2
    ends = np.array([1.0] + [0.0] * len(NODE_WEIGHTS) + [1.0])
    span = scale / nodes.along
    tilted = 8 / 3 * span**4 * slope**2 / nodes.length
    return inside * (2 * np.sqrt(np.pi) * span * weight**2 + tilted) - 2 * span**2 * ends * weight**2


def _picked(nodes: EdgeNodes, g: np.ndarray, which: np.ndarray):
    return (np.broadcast_to(v, (*which.shape, v.shape[-1]))[which] for v in (g, nodes.t, nodes.length))


def _first_order(nodes: EdgeNodes, a: np.ndarray, b: np.ndarray, per_point: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Integral of g^2 for the least-squares line through the points of enough contrast only."""
    t, lever = nodes.t[..., 1:-1], b[..., None] - a[..., None] * nodes.middle
    used = np.where(kept[..., 1:-1], NODE_WEIGHTS * nodes.length / 2, 0.0)
    total = used.sum(-1, keepdims=True)
    mean = (used * t).sum(-1, keepdims=True) / total
    spread = (used * (t - mean) ** 2).sum(-1, keepdims=True)
    weight = a[..., None] / total + (lever - a[..., None] * mean) * (t - mean) / spread
    variance = (used * weight**2 * np.where(kept, per_point, 0.0)[..., 1:-1]).sum(-1)
    return np.where((total[..., 0] >= MIN_USABLE) & (spread[..., 0] > 0), variance, np.inf)


def _double_integral(g: np.ndarray, t: np.ndarray, length: np.ndarray, scale: float) -> np.ndarray:
    """Integral of g(t) g(t') correlation(t - t') over both; never negative."""
    weighted, inner = g[..., 1:-1] * NODE_WEIGHTS * length / 2, t[..., 1:-1]
    kernel = correlation(inner[..., :, None] - inner[..., None, :], scale)
    return np.einsum("...i,...ij,...j->...", weighted, kernel, weighted)
