"""Where a chessboard's corners roughly are, by OpenCV's detectors."""

from __future__ import annotations

import cv2
import numpy as np

from measure.boards.growing import grown, trimmed

_SEEDS = ((3, 3), (5, 4), (4, 3))  # patterns that a larger board is grown from
_USUAL = ((9, 6), (8, 6), (7, 6), (8, 5), (7, 5))  # looked for where nothing grows
_LEAST = 16  # px of an image
_LONGEST = 1600  # px; a larger image is looked at smaller first
_BY_SECTORS = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE
_BY_SQUARES = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK


def approximate_corners(image: np.ndarray, shape: tuple[int, int] | None) -> np.ndarray | None:
    """Inner corners of a chessboard to some tenths of a pixel, shape (rows, columns, 2), (x, y) px; None if there is
    no board.

    Parameters
    ----------
    image : ndarray, shape (height, width)
        Grey levels.
    shape : (columns, rows) or None
        Inner corners; None where they are to be counted.
    """
    grey = eight_bits(image)
    scale = max(1.0, max(grey.shape) / _LONGEST)
    small = grey if scale == 1 else cv2.resize(grey, None, fx=1 / scale, fy=1 / scale, interpolation=cv2.INTER_AREA)
    found = _counted(small) if shape is None else _by_sectors(small, shape)
    found = _by_squares(small, shape) if found is None and shape else found
    if found is None:
        return None
    return (found + 0.5) * [grey.shape[1] / small.shape[1], grey.shape[0] / small.shape[0]] - 0.5


def eight_bits(image: np.ndarray) -> np.ndarray:
    low, high = np.percentile(image, [0.1, 99.9])
    return np.clip(np.rint((image - low) * (255 / max(high - low, 1e-300))), 0, 255).astype(np.uint8)


def _counted(grey: np.ndarray) -> np.ndarray | None:
    """A board of any size, the largest that grows from a part of it: with no more rows than columns, and begun at the
    end that is nearer to the image's first pixel."""
    parts = (_by_sectors(grey, seed, cv2.CALIB_CB_LARGER) for seed in _SEEDS)
    inner = [kept for part in parts if part is not None and (kept := trimmed(grey, part)) is not None]
    if not inner:
        parts = (_by_squares(grey, shape) for shape in _USUAL)
        inner = [kept for part in parts if part is not None and (kept := trimmed(grey, part)) is not None][:1]
    whole = [grown(grey, part) for part in inner]
    if not whole:
        return None
    grid = max(whole, key=lambda found: found.size)
    grid = np.rot90(grid) if len(grid) > grid.shape[1] else grid
    return grid if np.linalg.norm(grid[0, 0]) <= np.linalg.norm(grid[-1, -1]) else np.rot90(grid, 2)


def _by_sectors(grey: np.ndarray, shape: tuple[int, int], more: int = 0) -> np.ndarray | None:
    if min(grey.shape) < _LEAST:
        return None
    good, corners, counted = cv2.findChessboardCornersSBWithMeta(grey, shape, _BY_SECTORS | more)
    if not good:
        return None
    rows, columns = counted.shape if more else shape[::-1]
    return corners.reshape(rows, columns, 2).astype(float)


def _by_squares(grey: np.ndarray, shape: tuple[int, int]) -> np.ndarray | None:
    if min(grey.shape) < _LEAST:
        return None
    good, corners = cv2.findChessboardCorners(grey, shape, flags=_BY_SQUARES)
    return corners.reshape(*shape[::-1], 2).astype(float) if good else None
