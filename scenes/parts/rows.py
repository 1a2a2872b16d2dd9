"""Rows of arrays that are the same: corners of triangles that are one place, sides of triangles that are one edge."""

from __future__ import annotations

import numpy as np


def different(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The different ones of rows (n, d), in their order (k, d), and which of these each row is, (n,).

    As NumPy's ``unique`` along an axis tells; this sorts by one column after the other, where that compares whole rows.

    Examples
    --------
    >>> rows, which = different(np.array([[2, 1], [0, 5], [2, 1], [0, 3]]))
    >>> rows.tolist(), which.tolist()
    ([[0, 3], [0, 5], [2, 1]], [2, 1, 2, 0])
    """
    order = np.lexsort(np.asarray(rows).T[::-1])
    ordered = np.asarray(rows)[order]
    first = np.ones(len(ordered), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(1)
    which = np.empty(len(ordered), int)
    which[order] = np.cumsum(first) - 1
    return ordered[first], which
