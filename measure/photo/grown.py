"""Covariance of corners where the noise of neighbouring pixels is not independent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from measure.estimators.arrangement import ArrangementEstimator
from measure.features.corners import corner_response
from measure.features.layout import Layout, polygon_layout
from measure.features.shape import prepared
from measure.photo.recording import Recording
from measure.photo.uneven import shaded

_MARGIN = 60  # px around the corners that an estimator looks at


def corner_rows(image: np.ndarray, layout: Layout, estimator: str, threshold: float) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of the corners' coordinates by the pixels of an image, (2 C, P), and which pixels, flat, (P,)."""
    tool = prepared(layout, estimator, threshold)
    if isinstance(tool, ArrangementEstimator):
        return tool.response(tool.taken(image[None])[0])[tool.index(tool.arrangement.corners)], tool.pixels
    response = np.concatenate([corner_response(tool.calipers, pair) for pair in layout.corners])
    return response @ tool.respond_within(image), tool.pixels


def grown_covariance(
    image: np.ndarray, corners: np.ndarray, layout: Layout, seen: Recording, estimator: str, threshold: float
) -> np.ndarray:
    """Covariance of corners (C, 2) that an estimator found in an image whose noise is correlated, px^2, (2 C, 2 C).

    ``layout`` is the one that they were found with; NaN where the estimator's response is not known.
    """
    size = np.array(image.shape[::-1])
    low = np.clip(np.floor(corners.min(0) - _MARGIN), 0, size - 1).astype(int)
    high = np.clip(np.ceil(corners.max(0) + _MARGIN) + 1, 1, size).astype(int)
    part = np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]])
    here = polygon_layout(corners - low, replace(layout.optics, shape=part.shape))
    here = replace(here, defocus=layout.defocus)
    if layout.arrangement is not None:
        here = shaded(here, *(region.order for region in layout.arrangement.regions))
    rows, pixels = corner_rows(part, here, estimator, threshold)
    sigma = np.sqrt(seen.curve.variance(part.flat[pixels]))
    return seen.correlation.covariance(rows, pixels, sigma, part.shape[1])
