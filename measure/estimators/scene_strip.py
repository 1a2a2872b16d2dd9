"""Columns of a strip whose levels the scene knows, of an edge in a picture in which things hide or light each other.

The levels beside the edge are those that the scene has there, walls a pixel wide and shadows included, blurred as the
picture is. Unknown are where the edge is, the blur, how bright each side is and how that changes along the edge; and
with what the scene says of them, the inputs that it is not sure of (reflectances, places of lights): a shadow's border
beside the edge is where the picture has it. Least squares template matching (Gruen 1985), with known inputs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d, map_coordinates
from scipy.special import ndtr

from imaging.features.locator import CLEARANCE, edge_blur
from measure.estimators.coverage import NODE_WEIGHTS, NODES, density
from measure.estimators.estimate import Estimate
from measure.estimators.kinds import EstimatorKind
from measure.estimators.likelihood import Columns, LikelihoodEstimator
from measure.estimators.separate import SeparateEstimator, measurable
from measure.estimators.strip_pixels import LEAST_BLUR, are_own, pixels_beside
from measure.features.calipers import Caliper, edge_calipers
from measure.features.layout import Layout
from measure.features.levels import EdgeLevels
from scenes import InvalidInput, status

_BEYOND = 3.0  # px past the strip from where the blur still brings light into it
_FEWEST = 40  # pixels
_PITCH = 0.25  # px across an edge between places of a blurred image


class _Strip(NamedTuple):
    """P pixels: flat indices, ideal px (P, 2), places in the caliper (P,), px."""

    pixels: np.ndarray
    ideal: np.ndarray
    along: np.ndarray
    across: np.ndarray


def _estimator(layout: Layout, caliper: Caliper, index: int, clear: float) -> LikelihoodEstimator | None:
    """Estimator of one edge; None if too few pixels are free of other edges, or no contrast is expected.

    Parameters
    ----------
    layout : Layout
        That knows the scene's levels.
    caliper : Caliper
        Frame of the edge; its positions tell the part to use.
    index : int
        Which edge of the layout.
    clear : float
        How far from other edges a pixel is, px, unless it is nearer to this one.
    """
    strip = _strip(layout, caliper, index, clear)
    beside = layout.levels.beside(layout.names[index], _half_width(layout) + _BEYOND)
    columns = _columns(caliper, strip, beside) if strip.pixels.size >= _FEWEST else None
    if columns is None:
        return None
    noise = layout.optics.noise_at(beside.levels)
    deviation = float(np.sqrt(layout.optics.noise_variance if noise is None else noise.mean()))
    return LikelihoodEstimator.of((caliper,), strip.pixels, columns, layout.optics, deviation)


def _strip(layout: Layout, caliper: Caliper, index: int, clear: float) -> _Strip:
    """Pixels beside an edge: none that another edge may disturb that is nearer."""
    flat, points, along, across = pixels_beside(caliper, _half_width(layout))
    keep = are_own(layout, index, points, across, clear)
    return _Strip(flat[keep], points[keep], along[keep], across[keep])


def _half_width(layout: Layout) -> float:
    """To each side, px: no more than a smoothed profile across the edge takes, for all levels are known but for their
    scale."""
    return layout.optics.window_px + 4 * layout.optics.scale_px


def _columns(caliper: Caliper, strip: _Strip, beside: EdgeLevels) -> Columns | None:
    middle, along, edge = caliper.length / 2, beside.along, beside.levels.shape[1] // 2
    levels = beside.levels[:, edge], beside.levels[:, edge - 1]
    used = (along >= caliper.positions[0]) & (along <= caliper.positions[-1])
    contrast = levels[0] - levels[1]
    mean = float(np.sqrt(np.mean(contrast[used] ** 2))) if used.any() else 0.0
    if not mean > 0:
        return None
    slopes = [caliper.optics.gradient(strip.ideal, axis) for axis in (caliper.normal, caliper.direction)]
    blur = np.maximum(caliper.blur(strip.along), LEAST_BLUR) * np.linalg.norm(slopes[0], axis=-1)
    nodes = strip.across[:, None] + slopes[0] @ NODES.T
    lever = strip.along[:, None] + slopes[1] @ NODES.T
    thin = density(nodes / blur[:, None]) * NODE_WEIGHTS / blur[:, None]
    expected = np.interp(strip.along, along, contrast)[:, None] / mean
    basis = np.stack([np.ones_like(strip.along), (strip.along - middle) / caliper.length], 1)
    seen = _Blurred(beside, np.maximum(caliper.blur(along), LEAST_BLUR) * np.ones_like(along), lever, nodes)
    plus, minus = (seen(beside.levels * (sign * beside.middles > 0))[:, None] for sign in (1, -1))
    # the contrast that is expected, in the picture's own sides: the sum of squares of the former along the edge
    weight, places = contrast * used / np.sum(contrast[used] ** 2) * mean, (along - middle) / caliper.length
    row = np.stack(
        [weight @ levels[0], weight @ (levels[0] * places), -weight @ levels[1], -weight @ (levels[1] * places)]
    )
    return Columns(
        levels=np.concatenate([basis * plus, basis * minus], 1),
        start=row[None],
        stop=row[None],
        offsets=-np.stack([thin.sum(1), (thin * (lever - middle)).sum(1)], 1) * expected,
        blurs=-(thin * nodes / blur[:, None]).sum(1)[:, None] * expected,
        inputs=np.array([seen(each) for each in beside.changed]).reshape(-1, strip.pixels.size),
    )


class _Blurred:
    """Levels in cells beside an edge as pixels see them: blurred, and averaged over each pixel.

    Parameters
    ----------
    beside : EdgeLevels
    blur : ndarray, shape (m,)
        Standard deviation in each row, px.
    along, across : ndarray, shape (P, nodes)
        Places within each pixel, px.
    """

    def __init__(self, beside: EdgeLevels, blur: np.ndarray, along: np.ndarray, across: np.ndarray) -> None:
        grid = np.arange(beside.ends.min(), beside.ends.max(), _PITCH)
        first, self._pitch = beside.along[0], beside.along[1] - beside.along[0]
        self._kernels = np.diff(ndtr((beside.ends[:, None] - grid[:, None]) / blur[:, None, None]), axis=2)
        self._at = np.stack([(along - first) / self._pitch, (across - grid[0]) / _PITCH])
        self._blur = float(blur.mean())

    def __call__(self, levels: np.ndarray) -> np.ndarray:
        """Of levels (m, T), shape (P,)."""
        across = (self._kernels @ levels[..., None])[..., 0]
        smooth = gaussian_filter1d(across, self._blur / self._pitch, axis=0, mode="nearest")
        return (map_coordinates(smooth, self._at, order=3, mode="nearest") * NODE_WEIGHTS).sum(1)


@dataclass(frozen=True, eq=False)
class SceneStrip:
    """One of several edges that are measured one by one (`SeparateEstimator`)."""

    caliper: Caliper
    strip: LikelihoodEstimator

    @property
    def calipers(self) -> tuple[Caliper, ...]:
        return (self.caliper,)

    @property
    def pixels(self) -> np.ndarray:
        return self.strip.pixels

    def estimate(self, images: np.ndarray, noise_variance: np.ndarray | float) -> Estimate:
        """As `Estimator.estimate`; whatever the noise."""
        return self.strip.estimate(images)

    def noise_of(self, images: np.ndarray) -> float:
        """Nothing that is asked for."""
        return 0.0

    def covariance(self, estimate: Estimate, images: np.ndarray) -> np.ndarray:
        return self.strip.covariance(estimate, images)

    def respond_within(self, clean: np.ndarray, pixels: np.ndarray, *, asked: bool = False) -> np.ndarray:
        """Derivative of (level, slope) by some pixels, flat indices in order that hold all of `pixels`, (2, P)."""
        found = np.zeros((2, pixels.size))
        found[:, np.searchsorted(pixels, self.pixels)] = self.strip.respond_within(clean)
        return found


def _prepared(layout: Layout, threshold: float) -> SeparateEstimator:
    """Each edge by its strip; all are `clutter`: how wrong the scene's levels are, a simulation alone tells."""
    if layout.levels is None:  # beside another estimator: strips by themselves are joint there
        raise InvalidInput("estimator must be of two that measure each edge by itself, got 'strip'")
    clear, calipers, parts = CLEARANCE * edge_blur(layout.optics.most_blur_px), [], []
    for index, caliper in enumerate(edge_calipers(layout, clear, 0.0, 2 * clear)):
        part = _estimator(layout, caliper, index, clear) if measurable(caliper) else None
        if measurable(caliper):
            state = status.SHORT if part is None else status.CLUTTER
            caliper = replace(caliper, status=status.worst(caliper.status, state))
        calipers.append(caliper)
        parts.append(part and SceneStrip(caliper, part))
    return SeparateEstimator(tuple(calipers), tuple(parts))


SCENE_STRIP = EstimatorKind(_prepared, capture_px=0.125, exact_px=0.01, local=True, separate=True)
