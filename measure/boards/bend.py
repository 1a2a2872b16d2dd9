"""How a lens bends the lines of a board, from where its corners lie."""

from __future__ import annotations

import cv2
import numpy as np

from imaging.boards.windows import steps
from scenes.board_print import numbered

_DEGREES = ((3, 14), (2, 8))  # of the polynomial, and the corners that it takes


def bends(grid: np.ndarray) -> np.ndarray:
    """Curvature of the two edges through each corner, 1/px, shape (rows, columns, 2); towards their left normal.

    A homography keeps lines straight. What it leaves of the corners' places is a polynomial of low degree in place,
    whose second derivative along an edge, across it, is the edge's curvature. 0 where there are too few corners.

    Parameters
    ----------
    grid : ndarray, shape (rows, columns, 2)
        Corners, (x, y) px; NaN where one is not seen.
    """
    rows, columns = grid.shape[:2]
    return bends_at(numbered(columns, rows), grid.reshape(-1, 2), steps(grid).reshape(-1, 2, 2)).reshape(
        rows, columns, 2
    )


def bends_at(places: np.ndarray, corners: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """The same, shape (n, 2), of corners (n, 2), px, NaN where one is not seen, whose edges run (n, 2, 2) and which lie
    at (n, 2) on the board."""
    seen = np.isfinite(corners).all(-1)
    lines = [len(set(each)) for each in places[seen].T]
    degree = next((d for d, least in _DEGREES if seen.sum() >= least and min(lines) > d), 0)
    matrix = cv2.findHomography(places[seen], corners[seen])[0] if degree else None
    if matrix is None:
        return np.zeros(corners.shape)
    straight = cv2.perspectiveTransform(places[None], matrix)[0]
    middle, size = straight[seen].mean(0), np.ptp(straight[seen], axis=0).max() / 2
    u, v = ((straight - middle) / size).T
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    left = corners - straight
    coefficients = np.linalg.lstsq(np.stack([u**i * v**j for i, j in powers], 1)[seen], left[seen], rcond=None)[0]

    def second(by_u: int, by_v: int) -> np.ndarray:
        columns = [_derived(u, i, by_u) * _derived(v, j, by_v) for i, j in powers]
        return np.stack(columns, 1) @ coefficients / size**2

    toward = toward / np.linalg.norm(toward, axis=-1, keepdims=True)
    x, y = toward[..., :1], toward[..., 1:]
    turned = x**2 * second(2, 0)[:, None] + 2 * x * y * second(1, 1)[:, None] + y**2 * second(0, 2)[:, None]
    return turned[..., 1] * toward[..., 0] - turned[..., 0] * toward[..., 1]


def _derived(t: np.ndarray, power: int, times: int) -> np.ndarray:
    """Derivative of t^power."""
    factor = np.prod([power - k for k in range(times)]) if times else 1.0
    return factor * t ** max(power - times, 0)
