"""Where a chessboard's corners roughly are, by OpenCV's detectors."""

from __future__ import annotations

import cv2
import numpy as np

from imaging.boards.windows import steps
from measure.boards.growing import grown, refined, trimmed

_SEEDS = ((3, 3), (5, 4), (4, 3))  # patterns that a larger board is grown from
_USUAL = ((9, 6), (8, 6), (7, 6), (8, 5), (7, 5))  # looked for where nothing grows
_LEAST = 16  # px of an image
_ASTRAY = 0.2  # of the way to the next corner: further off where neighbours say that a corner is, it is not
_AGREED = 0.5  # of a corner's pairs and threes of neighbours
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
    if not good:
        return None
    grid = even(corners.reshape(*shape[::-1], 2).astype(float))
    return even(refined(grey, grid, float(np.linalg.norm(steps(grid), axis=-1).min())))


def even(grid: np.ndarray) -> np.ndarray:
    """The grid (rows, columns, 2), its corners that are astray moved to where their neighbours say.

    OpenCV may take a corner of the board's rim, or none, for an inner one. One after the other that is moved with which
    the fewest pairs and threes of neighbours agree, and of these the farthest off, until half of them do with each: one
    astray speaks for others, too.
    """
    grid = grid.copy()
    for _ in range(grid.size // 2):
        told = _told(grid)
        middle = np.nanmedian(told, 0)
        near = _ASTRAY * np.linalg.norm(steps(middle), axis=-1).min(-1)
        agree = (np.linalg.norm(told - grid, axis=-1) < near).sum(0) / np.isfinite(told[..., 0]).sum(0)
        off = np.linalg.norm(middle - grid, axis=-1)
        astray = np.argwhere((agree < _AGREED) & (off > 0))
        if not astray.size:
            break
        worst = min(map(tuple, astray), key=lambda at: (agree[at], -off[at]))
        grid[worst] = middle[worst]
    return grid


def _told(grid: np.ndarray) -> np.ndarray:
    """Where neighbours say that each corner is, straight on, between and across, (10, rows, columns, 2); NaN where
    there are none."""
    rows, columns = grid.shape[:2]
    wide = np.pad(grid, [(2, 2), (2, 2), (0, 0)], constant_values=np.nan)

    def beside(down: int, along: int) -> np.ndarray:
        return wide[2 + down : 2 + down + rows, 2 + along : 2 + along + columns]

    ways = ((0, 1), (1, 0), (0, -1), (-1, 0))
    straight = [2 * beside(*way) - beside(2 * way[0], 2 * way[1]) for way in ways]
    between = [(beside(*way) + beside(-way[0], -way[1])) / 2 for way in ways[:2]]
    across = [beside(down, 0) + beside(0, along) - beside(down, along) for down in (-1, 1) for along in (-1, 1)]
    return np.array([*straight, *between, *across])
