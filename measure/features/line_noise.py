"""Are the errors of lines by noise those that their derivative tells, wherever noise has them looked for?

An edge farther from its expected place than an estimator reaches is looked for again from where it seems, to a grid:
noise may decide whether, and from where. Where what is found depends on that, a line jumps from one image to the next.
Drawn images tell (`measure.features.rim_noise`).
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.special import ndtr

from measure.estimators.estimate import Estimator
from measure.estimators.kinds import ESTIMATORS
from measure.features.layout import Layout
from measure.features.lines import at_ends, capture, end_errors
from measure.features.rim_noise import drawn, is_linear
from measure.features.shape import find_shape, prepared
from scenes import status

_RARE = 1e-7  # probability below which no image is looked at from elsewhere
_MOST_PIXELS = 1 << 23  # of drawn images at a time, 64 MiB
_LITTLE = 1.0  # px


def torn(clean: np.ndarray, layout: Layout, name: str, threshold: float, response: sparse.csr_array) -> np.ndarray:
    """Of which edges the errors are others than a derivative tells, bool (E,).

    Asked only where some edge of the noise-free image lies about as far from its expected place as the estimator
    reaches, or farther. Where most do in the first drawn images by one that reaches little, all count as such.

    Parameters
    ----------
    clean : ndarray, shape (height, width)
    layout : Layout
    name : str
        Of the estimator, one that is not of the whole arrangement.
    threshold : float
    response : csr_array, shape (2 E, height * width)
        Derivative of (level, slope) of each edge by the pixels, from where it is expected.
    """
    here, measured = _offsets(clean[None], layout, name, threshold)
    if not (measured.any() and _is_doubtful(clean, layout, name, threshold)):
        return np.zeros(len(layout.names), bool)
    tool, some = prepared(layout, name, threshold), max(_MOST_PIXELS // clean.size, 1)
    lengths, linear, full, found = _lengths(tool), [], [], []
    for images in drawn(clean, tool.pixels, layout.optics):
        told = images.first_order(response).reshape(len(images), -1, 2)
        linear.append(at_ends(told[..., 0], told[..., 1], lengths))
        for start in range(0, len(images), some):
            offsets, measured = _offsets(images[start : start + some].whole(clean.shape), layout, name, threshold)
            full.append(offsets - here)
            found.append(measured)
        if len(linear) == 1 and _is_dear(layout, name) and _most(jumps := _jumping(linear, full, found)):
            return np.ones_like(jumps)
    return _jumping(linear, full, found)


def _jumping(linear: list[np.ndarray], full: list[np.ndarray], found: list[np.ndarray]) -> np.ndarray:
    """Which edges, bool (E,), have other errors than a derivative tells, in stacks of drawn images (n, E, ...)."""
    columns = (np.moveaxis(np.concatenate(each), 1, 0) for each in (linear, full, found))
    return np.array([not is_linear(*edge) for edge in zip(*columns, strict=True)])


def _is_dear(layout: Layout, name: str) -> bool:
    """Whether an estimator reaches so little that most images would be looked at from places of their own; not one of
    two, which is asked where each of them has told something."""
    return name in ESTIMATORS and ESTIMATORS[name].of(layout).capture_px < _LITTLE


def _most(jumps: np.ndarray) -> bool:
    """Whether most edges jump."""
    return bool(2 * jumps.sum() > jumps.size)


def _is_doubtful(clean: np.ndarray, layout: Layout, name: str, threshold: float) -> bool:
    """Whether an edge is looked for from elsewhere, surely or by chance."""
    tool, images = prepared(layout, name, threshold), clean[None]
    if any(caliper.status not in status.MEASURED for caliper in tool.calipers):
        return False
    estimate = tool.estimate(images)
    errors = end_errors(tool.covariance(estimate, images), _lengths(tool))
    offsets = at_ends(estimate.level, estimate.slope, _lengths(tool))
    beyond = np.abs(offsets) - capture(ESTIMATORS[name].of(layout).capture_px, errors)
    with np.errstate(divide="ignore", invalid="ignore"):
        chance = ndtr(beyond / errors)  # of no noise 0 or 1
    return not chance.max() < _RARE  # NaN: what is not found is looked for again


def _offsets(images: np.ndarray, layout: Layout, name: str, threshold: float) -> tuple[np.ndarray, np.ndarray]:
    """How far lines in images (n, height, width) lie from the expected edges' ends, px, (n, E, 2), and whether they are
    found, (n, E)."""
    shape = find_shape(images, layout, name, threshold, judged=False)
    calipers = prepared(layout, name, threshold).calipers
    ends = np.array([each.at(np.array([0.0, each.length]), np.zeros(2)) for each in calipers])
    away = np.einsum("nei,neki->nek", shape.normals, shape.points[:, :, None] - ends)
    whole = np.isin(shape.whole, status.MEASURED)
    return away, np.isin(shape.edge_status, status.MEASURED) & whole[:, None]


def _lengths(tool: Estimator) -> np.ndarray:
    return np.array([caliper.length for caliper in tool.calipers])
