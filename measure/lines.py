"""A line through edge points, in the frame of its expected edge."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from measure.points import EdgePoints
from planner.locator import correlation


class Lines(NamedTuple):
    """Lines offset = mean_offset + tan(tilt) (along - mean_along); all arrays of shape (n,).

    ``scatter`` is the root mean square distance of the points from their line, px.
    """

    mean_along: np.ndarray
    mean_offset: np.ndarray
    tilt: np.ndarray
    count: np.ndarray
    scatter: np.ndarray


def fit_lines(points: EdgePoints) -> Lines:
    """Total-least-squares lines through the valid points of each image (Pearson's principal axis).

    Fewer than two points, or all at one place, leave NaN.
    """
    count = points.valid.sum(1)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean_along = (points.along * points.valid).sum(1) / count
        mean_offset = (points.offset * points.valid).sum(1) / count
        s = (points.along - mean_along[:, None]) * points.valid
        e = (points.offset - mean_offset[:, None]) * points.valid
        ss, ee, se = (s * s).sum(1), (e * e).sum(1), (s * e).sum(1)
        tilt = np.where(ss > 0, np.arctan2(2 * se, ss - ee) / 2, np.nan)
        scatter = np.sqrt((((e - np.tan(tilt)[:, None] * s) * np.cos(tilt)[:, None]) ** 2).sum(1) / count)
    return Lines(mean_along, mean_offset, tilt, count, scatter)


def regression(along: np.ndarray) -> np.ndarray:
    """Linear map from offsets at places (m,) to (mean offset, slope): what `fit_lines` does to first order, (2, m)."""
    s = along - along.mean()
    return np.stack([np.full(s.size, 1 / s.size), s / (s @ s)])


def unit_covariance(along: np.ndarray, scale: float) -> np.ndarray:
    """Covariance of (mean offset, slope), (2, 2), for points of variance 1 px^2 that the smoothing correlates."""
    response = regression(along)
    return response @ correlation(along[:, None] - along, scale) @ response.T
