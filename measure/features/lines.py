"""A line through edge points, in the caliper of its expected edge."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from measure.features.points import EdgePoints

_GAP = 1.0  # px; a point stands for no more of an edge to either side


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


def trend_along(along: np.ndarray, value: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weighted mean of values (..., n, m) at places (n, m), px, their change per px, and their line's value at 0.

    All of shape (..., n); 0 where there are no values.
    """
    total = np.maximum(weights.sum(-1), np.finfo(float).tiny)
    mean, middle = ((part * weights).sum(-1) / total for part in (value, along))
    s = (along - middle[:, None]) * weights
    spread = (s * (along - middle[:, None])).sum(-1)
    slope = (s * value).sum(-1) / np.where(spread > 0, spread, np.inf)
    return mean, slope, mean - slope * middle


def cells(along: np.ndarray, valid: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Length of an edge, px, that each of the valid points at places (n, m) in ascending order stands for, (n, m).

    Halfway to its neighbours, to the limits of the edge at its ends, and at most `_GAP` either way. With these weights
    a sum over points is an integral along the edge, the same however densely the points lie.
    """
    before = np.maximum.accumulate(np.where(valid, along, -np.inf), 1)
    after = np.minimum.accumulate(np.where(valid, along, np.inf)[:, ::-1], 1)[:, ::-1]
    edge = np.full((len(along), 1), np.inf)
    before, after = np.hstack([-edge, before[:, :-1]]), np.hstack([after[:, 1:], edge])
    left = np.where(np.isfinite(before), (along - before) / 2, along - limits[0])
    right = np.where(np.isfinite(after), (after - along) / 2, limits[1] - along)
    return (np.clip(left, 0, _GAP) + np.clip(right, 0, _GAP)) * valid
