"""The calibrated variance model: absolute, from the image model and the gradient locator's closed form."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial.legendre import legvander

from imaging.features.circles import calibrated_circle
from imaging.features.locator import FEWEST, MIN_CONTRAST, MIN_USABLE, correlation, lacking, located_kappa2
from imaging.features.measurand import normals
from imaging.light.appearance import is_separable
from imaging.models.along import NODE_WEIGHTS, NODES, Along, EdgeNodes
from imaging.models.errors import Errors, LineVariance, combined
from imaging.models.strong import ROUGH
from imaging.pictures import Pictures
from imaging.row_noise import of_lines, of_points

SHORT = 10.0  # smoothing scales: shorter edges take the sum over their points
POINTS = np.linspace(-1, 1, FEWEST)  # of a short edge, in half used lengths from the middle
POINT_WEIGHTS = np.array([0.5, *[1.0] * (FEWEST - 2), 0.5]) * 2 / (FEWEST - 1)


def calibrated(pictures: Pictures) -> Errors:
    """Absolute px^2 from camera, exposure, blur, noise, image length and the locator's closed form.

    Edge points lie up to 2 s apart along the trimmed edge (`locator.spacing`), of which the first and the last count
    half; their errors have variance kappa^2 s_n^2 / C^2, s_n^2 the mean of both sides' noise, and correlation
    exp(-d^2 / (4 s^2)). With f(t) the weight that the least-squares line gives to an error at t in A d + B theta, over
    the spacing, and g = f sigma, the variance is 2 sqrt(pi) s times the integral of g^2, with what the points are
    short of and have more (`locator.lacking`), for a linear g on a long edge; on an edge of less than 10 s the sum
    over its points itself. Where the contrast changes by more than a factor 2
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
                variance[short] = _sum_of_points(*_picked(nodes, weight * np.sqrt(per_point), short), scale)
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
        return calibrated_circle(circle, located_kappa2(scale, circle.blur), scale, MIN_CONTRAST**2, shared)

    variance = _quadratic(line_variance, nodes)
    return combined(pictures, variance, squared.mean(-1), noise.mean(-1), found, cut_off=along.cut_off)


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
    length = nodes.length[..., 0]
    slope = 12 * (b - a * nodes.middle[..., 0]) / length**3  # what is shared changes little from point to point
    added = of_lines(
        scene.noise, a / length, slope, length, normals(along.measurands.view), blur, scene.locator.scale_px
    )
    return added * across**2 / along.squared.mean(-1)


def point_variance(nodes: EdgeNodes, scale: float) -> np.ndarray | float:
    """Variance of an edge point's offset in ideal px at unit noise and unit contrast."""
    return located_kappa2(scale, nodes.blur) * np.square(nodes.across)


def line_weight(nodes: EdgeNodes, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """f(t): what an error at t adds to A d + B theta of the least-squares line, (..., E, n)."""
    return (a[..., None] + line_slope(nodes, a, b) * nodes.length * nodes.t) / nodes.length


def line_slope(nodes: EdgeNodes, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Its derivative by t, (..., E, 1): the points' sum of t^2 is L^3 / 12 + L h^2 / 6 over the spacing h."""
    spread = nodes.length * (nodes.length**2 + 2 * nodes.spacing**2) / 12
    return (b[..., None] - a[..., None] * nodes.middle) / spread


def long_edge(nodes: EdgeNodes, weight: np.ndarray, slope: np.ndarray, scale: float) -> np.ndarray:
    """Coefficients, (..., E, n), with which the points' variances add up to a long edge's line's.

    The smoothing scale is that of recorded px: along the edge it spans scale / along ideal px.
    """
    inside = np.concatenate([[0], NODE_WEIGHTS, [0]]) * nodes.length / 2
    ends = np.array([1.0] + [0.0] * len(NODE_WEIGHTS) + [1.0])
    span = scale / nodes.along
    end, tilt = lacking((nodes.spacing / span) ** 2)
    tilted = (tilt * span**4 / nodes.length + np.sqrt(np.pi) / 3 * span * nodes.spacing**2) * slope**2
    return inside * (2 * np.sqrt(np.pi) * span * weight**2 + tilted) - end * span**2 * ends * weight**2


@cache
def to_points() -> np.ndarray:
    """Takes what is known at an edge's nodes to the points of a short one, (`FEWEST`, n): by a polynomial."""
    nodes = np.array([-1.0, *NODES, 1.0])
    return legvander(POINTS, nodes.size - 1) @ np.linalg.inv(legvander(nodes, nodes.size - 1))


def point_products(g: np.ndarray, length: np.ndarray, scale: float) -> np.ndarray:
    """Products of what the points of short edges add, (..., `FEWEST`, `FEWEST`), whose sum is the variance.

    ``g`` is given at the nodes, (..., n), ``length`` is (..., 1).
    """
    weighted = g @ to_points().T * POINT_WEIGHTS * length / 2
    kernel = correlation((POINTS[:, None] - POINTS) * length[..., None] / 2, scale)
    return weighted[..., :, None] * weighted[..., None, :] * kernel


def _picked(nodes: EdgeNodes, g: np.ndarray, which: np.ndarray):
    return (np.broadcast_to(v, (*which.shape, v.shape[-1]))[which] for v in (g, nodes.length))


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


def _sum_of_points(g: np.ndarray, length: np.ndarray, scale: float) -> np.ndarray:
    """Sum of g g' correlation over the points of short edges; never negative."""
    return point_products(g, length, scale).sum((-1, -2))
