"""Pixels beside a segment of a line, and their numbers among themselves."""

from __future__ import annotations

import numpy as np


def distance_to_segment(points: np.ndarray, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Distance of points (..., 2) from a segment, px."""
    along = stop - start
    fraction = np.clip((points - start) @ along / max(float(along @ along), np.finfo(float).tiny), 0, 1)
    return np.linalg.norm(points - start - fraction[..., None] * along, axis=-1)


def pixels_along(
    start: np.ndarray, stop: np.ndarray, reach: float, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (y, x), row by row, of an image (height, width): all within ``reach`` px of a segment, and some more.

    Those of its box that lie so near to its line: a slanting segment costs what an upright one does.

    >>> [part.tolist() for part in pixels_along(np.array([1.0, 1.0]), np.array([4.0, 4.0]), 0.5, (6, 9))]
    [[1, 2, 3, 4], [1, 2, 3, 4]]
    """
    reach = reach + 1e-6
    size = np.array(shape[::-1])
    low = np.clip(np.ceil(np.minimum(start, stop) - reach), 0, size).astype(int)
    high = np.clip(np.floor(np.maximum(start, stop) + reach), -1, size - 1).astype(int)
    (x, y), length = stop - start, float(np.hypot(*(stop - start)))
    rows = np.arange(low[1], high[1] + 1)
    first, last = np.full(rows.size, low[0]), np.full(rows.size, high[0])
    if abs(y) * max(shape) > length * reach:  # else its band leaves each row where the box does
        middle, half = start[0] + (rows - start[1]) * x / y, reach * length / abs(y)
        first = np.clip(np.ceil(middle - half), first, size[0]).astype(int)
        last = np.clip(np.floor(middle + half), -1, last).astype(int)
    count = np.maximum(last - first + 1, 0)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.repeat(rows, count), np.repeat(first, count) + within


def numbered(size: int, *indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The numbers below ``size`` that occur, in order, and the place of each among them, (size,), int32.

    >>> used, place = numbered(9, np.array([7, 2]), np.array([2, 4]))
    >>> used.tolist(), place[[2, 4, 7]].tolist()
    ([2, 4, 7], [0, 1, 2])
    """
    seen = np.zeros(size, bool)
    for each in indices:
        seen[each] = True
    used, place = np.flatnonzero(seen), np.empty(size, np.int32)
    place[used] = np.arange(used.size)
    return used, place
