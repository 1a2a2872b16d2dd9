"""A part of a chessboard's corners, grown line by line to the whole board."""

from __future__ import annotations

import cv2
import numpy as np

from imaging.boards.windows import steps

_ALIKE = 0.7  # of its neighbour: how strongly a corner has to alternate; at the board's rim it is a half
_FEWEST, _MOST = 3, 200  # lines


def grown(grey: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """The grid with all lines of corners that continue it on its four sides.

    Parameters
    ----------
    grey : ndarray of uint8, shape (height, width)
    grid : ndarray, shape (rows, columns, 2)
        Corners, (x, y) px; at least 3 each way.
    """
    for _ in range(2):  # a line may be whole only once the grid has grown across it
        for turn in range(4):
            turned = np.rot90(grid, turn)
            while len(turned) < _MOST and (line := _next(grey, turned)) is not None:
                turned = np.concatenate([turned, line[None]])
            grid = np.rot90(turned, -turn)
    return grid


def trimmed(grey: np.ndarray, grid: np.ndarray) -> np.ndarray | None:
    """The grid without outer lines that lie on the board's rim; None if fewer than 3 each way are left."""
    for turn in range(4):
        turned = np.rot90(grid, turn)
        while min(turned.shape[:2]) >= _FEWEST and not _alternates(grey, turned[-2], turned[-1], steps(turned)[-2:]):
            turned = turned[:-1]
        grid = np.rot90(turned, -turn)
    return grid if min(grid.shape[:2]) >= _FEWEST else None


def _alternates(grey: np.ndarray, before: np.ndarray, line: np.ndarray, toward: np.ndarray) -> bool:
    """Whether all corners of a line are crossings as those of the line before it, the other way round."""
    known, here = _alternation(grey, before, toward[0]), _alternation(grey, line, toward[1])
    return bool((-np.sign(known) * here > _ALIKE * np.abs(known)).all())


def _next(grey: np.ndarray, grid: np.ndarray) -> np.ndarray | None:
    """The line of corners after the last row, if there is one."""
    line = 3 * grid[-1] - 3 * grid[-2] + grid[-3]
    toward = steps(np.concatenate([grid[-2:], line[None]]))[1:]
    size = float(np.linalg.norm(toward, axis=-1).min())
    room = 0.5 * size + 2
    if not (np.isfinite(line).all() and (line > room).all() and (line < np.array(grey.shape[::-1]) - 1 - room).all()):
        return None
    found = refined(grey, line, size)
    if np.linalg.norm(found - line, axis=1).max() > 0.35 * size:
        return None
    return found if _alternates(grey, grid[-1], found, toward) else None


def refined(grey: np.ndarray, corners: np.ndarray, size: float) -> np.ndarray:
    """Corners (..., 2) px as OpenCV refines them, the least way to the next one being such a size, px."""
    half = max(int(0.3 * size), 2)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.01)
    start = np.ascontiguousarray(corners.reshape(-1, 1, 2), np.float32)
    return cv2.cornerSubPix(grey, start, (half, half), (-1, -1), criteria).reshape(corners.shape).astype(float)


def _alternation(grey: np.ndarray, corners: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Mean of two opposite quadrants less that of the other two, grey levels, shape (n,)."""
    total = np.zeros(len(corners))
    for one, other in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        places = corners + 0.3 * (one * toward[:, 0] + other * toward[:, 1])
        levels = cv2.remap(grey, np.ascontiguousarray(places[:, None], np.float32), None, cv2.INTER_LINEAR)[:, 0]
        total += one * other * levels.astype(float) / 2
    return total
