"""A line through edge points, in the caliper of its expected edge."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from measure.features.points import EdgePoints
from planner.features.locator import correlation


class Lines(NamedTuple):
    """Lines offset = mean_offset + tan(tilt) (along - mean_along); all arrays of shape (n,).

    ``scatter`` is the root mean square distance of the points from their line, px.
    """

    mean_along: np.ndarray
    mean_offset: np.ndarray
    tilt: np.ndarray
    count: np.ndarray
    scatter: np.ndarray


def fit_lines(points: EdgePoints, weights: np.ndarray | float = 1.0) -> Lines:
    """Total-least-squares lines through the valid points of each image (Pearson's principal axis).

    Fewer than two points, or all at one place, leave NaN. ``weights`` (m,) weigh the squared distances.
    """
    count, weight = points.valid.sum(1), points.valid * weights
    with np.errstate(divide="ignore", invalid="ignore"):
        total = weight.sum(1)
        mean_along = (points.along * weight).sum(1) / total
        mean_offset = (points.offset * weight).sum(1) / total
        s = points.along - mean_along[:, None]
        e = points.offset - mean_offset[:, None]
        ss, ee, se = ((weight * product).sum(1) for product in (s * s, e * e, s * e))
        tilt = np.where(ss > 0, np.arctan2(2 * se, ss - ee) / 2, np.nan)
        scatter = np.sqrt((((e - np.tan(tilt)[:, None] * s) * np.cos(tilt)[:, None]) ** 2).sum(1) / count)
    return Lines(mean_along, mean_offset, tilt, count, scatter)


def regression(along: np.ndarray, weights: np.ndarray | float = 1.0) -> np.ndarray:
    """Linear map from offsets at places (m,) to (mean offset, slope): what `fit_lines` does to first order, (2, m)."""
    weight = np.broadcast_to(weights, along.shape) / np.broadcast_to(weights, along.shape).sum()
    s = along - weight @ along
    return np.stack([weight, weight * s / (weight @ (s * s))])


def trapezoid(along: np.ndarray) -> np.ndarray:
    """Weights that make evenly spaced places (m,), both ends among them, stand for the whole line between the ends."""
    weights = np.ones(along.size)
    if along.size > 2:
        weights[[0, -1]] = 0.5
    return weights


def unit_covariance(along: np.ndarray, scale: float) -> np.ndarray:
    """Covariance of (mean offset, slope), (2, 2), for points of variance 1 px^2 that the smoothing correlates."""
    response = regression(along)
    return response @ correlation(along[:, None] - along, scale) @ response.T
