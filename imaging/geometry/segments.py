"""Places and pixels beside segments of lines, and these pixels' numbers among themselves."""

from __future__ import annotations

import numpy as np

_ROUNDING = 1e-6  # px


def distance_to_segment(points: np.ndarray, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Distance of points (..., 2) from a segment, px."""
    along = stop - start
    fraction = np.clip((points - start) @ along / max(float(along @ along), np.finfo(float).tiny), 0, 1)
    return np.linalg.norm(points - start - fraction[..., None] * along, axis=-1)


def within_reach(segments: np.ndarray, points: np.ndarray, reach: float) -> np.ndarray:
    """Segments (k, 2, 2) of some, (n, 2, 2), all that come within ``reach`` of one of the points (P, 2), and some more:
    those whose box comes so near to that of the points.

    >>> within_reach(np.array([[[0.0, 0.0], [1.0, 0.0]], [[5.0, 0.0], [9.0, 0.0]]]), np.array([[3.0, 1.0]]), 2.5)
    array([[[0., 0.],
            [1., 0.]],
    <BLANKLINE>
           [[5., 0.],
            [9., 0.]]])
    >>> within_reach(np.array([[[0.0, 0.0], [1.0, 0.0]], [[5.0, 0.0], [9.0, 0.0]]]), np.array([[3.0, 1.0]]), 1.5).size
    0
    """
    if not (points.size and segments.size):
        return segments[:0]
    low, high = points.min(0) - reach - _ROUNDING, points.max(0) + reach + _ROUNDING
    return segments[((segments.max(1) >= low) & (segments.min(1) <= high)).all(1)]


def pixels_along(
    start: np.ndarray, stop: np.ndarray, reach: float, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (y, x), row by row, of an image (height, width): all within ``reach`` px of a segment, and some more.

    Those of its box that lie so near to its line: a slanting segment costs what an upright one does.

    >>> [part.tolist() for part in pixels_along(np.array([1.0, 1.0]), np.array([4.0, 4.0]), 0.5, (6, 9))]
    [[1, 2, 3, 4], [1, 2, 3, 4]]
    """
    reach = reach + _ROUNDING
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
