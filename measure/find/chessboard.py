"""A chessboard in a photograph, found by OpenCV."""

from __future__ import annotations

import cv2
import numpy as np

from measure.find.candidate import CHESSBOARD, Candidate
from measure.find.coarse import Coarse

_LEAST_SIDE = 32  # px of an image
_ALTERNATE = 0.9  # part of the neighbouring squares of which one is bright and one dark
_STANDS_OUT = 5.0  # their difference over the noise


def find_chessboard(coarse: Coarse) -> Candidate | None:
    """The chessboard with at least 3 x 3 inner corners, or None; each square differs from its neighbours."""
    if min(coarse.smooth.shape) < _LEAST_SIDE:
        return None
    low, high = np.percentile(coarse.smooth, [0.1, 99.9])
    grey = np.clip((coarse.smooth - low) * (255 / max(float(high - low), 1e-300)), 0, 255).astype(np.uint8)
    good, corners, counted = cv2.findChessboardCornersSBWithMeta(
        grey, (3, 3), cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
    )
    if not good:
        return None
    grid = corners.reshape(*counted.shape, 2).astype(float)
    alternating, step = _alternation(coarse, grid)
    if alternating < _ALTERNATE or step < _STANDS_OUT:
        return None
    outline = coarse.fine(np.array([grid[0, 0], grid[0, -1], grid[-1, -1], grid[-1, 0]]))
    length = np.linalg.norm(np.diff(grid, axis=0), axis=-1).sum() + np.linalg.norm(np.diff(grid, axis=1), axis=-1).sum()
    score = float(step * alternating * np.sqrt(length))
    return Candidate(CHESSBOARD, outline, alternating, step, score, grid=coarse.fine(grid))


def _alternation(coarse: Coarse, grid: np.ndarray) -> tuple[float, float]:
    """Part of the pairs of neighbouring squares that differ as those of a board do, and the median difference over the
    noise; the squares are those between four inner corners."""
    middles = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    levels = coarse.levels(middles.reshape(-1, 2)).reshape(middles.shape[:2])
    row, column = np.indices(levels.shape)
    sign = np.where((row + column) % 2 == 0, 1, -1)
    down, right = np.diff(levels, axis=0) * sign[1:], np.diff(levels, axis=1) * sign[:, 1:]
    pairs = np.concatenate([down.ravel(), right.ravel()])
    pairs = pairs * np.sign(np.median(pairs))
    enough = pairs > np.median(pairs) / 3
    return float(enough.mean()), float(np.median(pairs)) / max(coarse.noise, 1e-300)
