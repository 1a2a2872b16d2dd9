"""Covariance of corners where the noise of neighbouring pixels is not independent."""

from __future__ import annotations

import numpy as np

from measure.estimators.arrangement import ArrangementEstimator
from measure.features.corners import corner_response
from measure.features.layout import Layout
from measure.features.shape import prepared
from measure.photo.recording import Recording


def corner_rows(image: np.ndarray, layout: Layout, estimator: str, threshold: float) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of the corners' coordinates by the pixels of an image, (2 C, P), and which pixels, flat, (P,)."""
    tool = prepared(layout, estimator, threshold)
    if isinstance(tool, ArrangementEstimator):
        return tool.response(tool.taken(image[None])[0])[tool.index(tool.arrangement.corners)], tool.pixels
    response = np.concatenate([corner_response(tool.calipers, pair) for pair in layout.corners])
    return response @ tool.respond_within(image), tool.pixels


def grown_covariance(
    image: np.ndarray, layout: Layout, seen: Recording, estimator: str, threshold: float
) -> np.ndarray:
    """Covariance of corners that an estimator found in an image whose noise is correlated, px^2, (2 C, 2 C).

    ``layout`` is the one that they were found with; NaN where the estimator's response is not known.
    """
    rows, pixels = corner_rows(image, layout, estimator, threshold)
    sigma = np.sqrt(seen.curve.variance(image.flat[pixels]))
    return seen.correlation.covariance(rows, pixels, sigma, image.shape[1])
