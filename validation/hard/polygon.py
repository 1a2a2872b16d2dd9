"""Images made without the renderer: a convex polygon, exactly blurred and exactly averaged over square pixels."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.special import ndtr

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_FAR = 9  # standard deviations
_ROWS = 16  # of pixels at a time: only scan lines near them count


def polygon_image(
    corners: np.ndarray, shape: tuple[int, int], blur: float, contrast: float = 100.0, background: float = 0.0
) -> np.ndarray:
    """Grey levels (height, width) of a uniform convex polygon, corners (k, 2) in px, under a Gaussian blur.

    Along x everything is in closed form: the blurred span of a scan line averaged over a pixel is a difference of
    integrals of the normal distribution. Along y Gauss-Legendre quadrature on panels that end at the vertices and in
    which no side moves by more than half a pixel either way: the integrand is smooth in them, so the error is below
    1e-9 of the contrast.
    """
    corners = np.asarray(corners, float)
    lines, weights = scan_lines(corners)
    left, right = spans(corners, lines)
    span = _beyond(left, shape[1], blur) - _beyond(right, shape[1], blur)
    picture = np.empty(shape)
    for first in range(0, shape[0], _ROWS):
        rows = np.arange(first, min(first + _ROWS, shape[0]))
        near = slice(*np.searchsorted(lines, (rows[0] - 0.5 - _FAR * blur, rows[-1] + 0.5 + _FAR * blur)))
        away = lines[near] - rows[:, None]
        weight = (ndtr((away + 0.5) / blur) - ndtr((away - 0.5) / blur)) * weights[near]
        picture[rows] = weight @ span[near]
    return background + contrast * picture


def _beyond(ends: np.ndarray, width: int, blur: float) -> np.ndarray:
    """What pixels of a line (lines, width) show of all that is beyond an end under the blur: 0 before, 1 far beyond."""
    count = 2 * int(np.ceil(_FAR * blur)) + 4  # of pixels near an end; as many are kept outside the picture each way
    first = np.clip(np.floor(ends).astype(int) - count // 2 + 1, -count, width)[:, None]
    found = (np.arange(-count, width + count) >= first + count).astype(float)
    borders = _ramp((first + np.arange(count + 1) - 0.5 - ends[:, None]) / blur)
    np.put_along_axis(found, first + count + np.arange(count), blur * np.diff(borders, axis=1), axis=1)
    return found[:, count : count + width]


def scan_lines(
    corners: np.ndarray, nodes: np.ndarray = _NODES, weights: np.ndarray = _WEIGHTS
) -> tuple[np.ndarray, np.ndarray]:
    """Quadrature nodes and weights along y on panels in which no side moves by more than half a pixel along x or y."""
    breaks = np.unique(corners[:, 1])
    way = np.abs(np.roll(corners, -1, 0) - corners)
    slope = way[:, 0] / np.where(way[:, 1] > 0, way[:, 1], np.inf)
    low, high = np.sort(np.stack([corners[:, 1], np.roll(corners[:, 1], -1)]), axis=0)
    edges = []
    for a, b in pairwise(breaks):
        steepest = max(1.0, slope[(low <= a) & (high >= b)].max())
        edges.append(np.linspace(a, b, int(np.ceil(2 * steepest * (b - a))) + 1)[:-1])
    edges = np.append(np.concatenate(edges), breaks[-1])
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + nodes)).ravel(), (half * weights).ravel()


def _ramp(u: np.ndarray) -> np.ndarray:
    """Integral of the standard normal distribution function; beyond 9 its asymptote, which is exact in doubles."""
    found, near = np.maximum(u, 0.0), np.abs(u) < _FAR
    u = u[near]
    found[near] = u * ndtr(u) + np.exp(-u * u / 2) / np.sqrt(2 * np.pi)
    return found


def spans(corners: np.ndarray, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each horizontal line enters and leaves the polygon."""
    left, right = np.full(lines.size, np.inf), np.full(lines.size, -np.inf)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, 0), strict=True):
        if y0 != y1:
            inside = (lines - y0) * (lines - y1) <= 0
            x = x0 + (x1 - x0) * (lines - y0) / (y1 - y0)
            left, right = np.where(inside, np.minimum(left, x), left), np.where(inside, np.maximum(right, x), right)
    return left, right
