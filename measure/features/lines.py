"""A line through edge points, in the caliper of its expected edge. NumPy alone: a recipe has this file."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from measure.features.points import DECIDED, EdgePoints
from scenes import status

_MIN_FOUND = 0.5  # part of an edge's positions at which a point must be found
_DIMMEST = 0.1  # contrast at an end over that in the middle, below which it is no straight line any more
_MAX_SCATTER = 0.8  # px; in noise alone points scatter by 0.9 to 1.5 (window 3 px), on the weakest edges by 0.3
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


def fit_lines(points: EdgePoints, weights: np.ndarray | float = 1.0, there: np.ndarray | float = 1.0) -> Lines:
    """Total-least-squares lines through the valid points of each image (Pearson's principal axis).

    Fewer than two points, or all at one place, leave NaN. ``weights`` (m,) weigh the squared distances; ``there`` is 0
    for what is no place at all.
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
        scatter = np.sqrt((there * ((e - np.tan(tilt)[:, None] * s) * np.cos(tilt)[:, None]) ** 2).sum(1) / count)
    return Lines(mean_along, mean_offset, tilt, count, scatter)


def line_state(
    points: EdgePoints, lines: Lines, size: np.ndarray | int, least_contrast: float, noise_variance: np.ndarray | float
) -> np.ndarray:
    """Status of the lines of n images through points at ``size`` places, by noise of a variance, grey levels^2, (n,).

    ``least_contrast`` is the contrast over noise below which a point's error is no longer linear in the noise.
    """
    enough = points.valid.sum(1) >= np.maximum(_MIN_FOUND * np.asarray(size), 3)
    clear = points.contrast > least_contrast * np.sqrt(noise_variance)
    edge = enough & clear & points.sure & (lines.scatter < _MAX_SCATTER)
    one = np.where(points.certain >= DECIDED, status.OK, status.ILL_CONDITIONED)
    return np.where(points.reversed, status.SIGN_CHANGE, np.where(edge, one, status.LOW_CONTRAST))


def edge_states(fixed: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Statuses (n, E) of edges from what geometry alone tells (E,) and from what is found of their lines (n, E)."""
    worse = (fixed == status.OK) | ((fixed == status.CLUTTER) & (found != status.OK))
    return np.where(worse, found, fixed)


def level_and_slope(points: EdgePoints, lines: Lines) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of lines their offset at the start of the edge and slope, (n,), and the contrast at the start and its change
    per px, (n, 2)."""
    slope = np.tan(lines.tilt)
    contrast = np.stack([points.contrast - points.trend * lines.mean_along, points.trend], -1)
    return lines.mean_offset - slope * lines.mean_along, slope, contrast


def inverse_contrast(contrast: np.ndarray, places: np.ndarray) -> np.ndarray:
    """1 / contrast at three places (3,) or (n, 3) of edges of contrasts (n, 2) at their start and per px, (n, 3).

    NaN where there is none in the middle.
    """
    told = contrast[:, :1] + contrast[:, 1:] * places
    middle = told[:, 1:2]
    return 1 / np.where(middle > 0, np.maximum(told, _DIMMEST * middle), np.nan)


def regression(along: np.ndarray, weights: np.ndarray | float = 1.0) -> np.ndarray:
    """Linear map from offsets at places (m,) to (mean offset, slope): what `fit_lines` does to first order, (2, m)."""
    weight = np.broadcast_to(weights, along.shape) / np.broadcast_to(weights, along.shape).sum()
    s = along - weight @ along
    return np.stack([weight, weight * s / (weight @ (s * s))])


def line_map(along: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Linear map from offsets at places (m,) to (offset at the start of the edge, slope), (2, m)."""
    mean, slope = regression(along, weights)
    return np.stack([mean - (weights @ along) / weights.sum() * slope, slope])


def by_noise(along: np.ndarray, weights: np.ndarray, places: np.ndarray) -> np.ndarray:
    """What errors of points at unit contrast do to (level, slope) where 1 / contrast is 1 at one of three places (3,),
    0 at the others, (6, m)."""
    shapes = np.linalg.inv(np.vander(places, 3)).T @ np.vander(along, 3).T
    return (line_map(along, weights)[:, None] * shapes).reshape(6, -1)


def at_ends(level: np.ndarray, slope: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """How far lines (n, E) lie from their expected edges of lengths (E,) at both ends, px, (n, E, 2)."""
    return np.stack([level, level + slope * lengths], -1)


def end_errors(covariance: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Standard deviation of each line's offset at its two ends, px, (n, E, 2), from the lines' covariance."""
    a, b, ab = (np.einsum("nee->ne", covariance[:, i::2, j::2]) for i, j in ((0, 0), (1, 1), (0, 1)))
    found = np.sqrt(np.stack([a, a + 2 * lengths * ab + lengths**2 * b], -1))
    return np.where(np.isnan(found), 0.0, found)


def capture(least: float, errors: np.ndarray) -> np.ndarray:
    """Up to which offsets lines are taken from where they are expected, by their standard deviations, (n, E, 2)."""
    return np.maximum(least, 5 * errors)


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
