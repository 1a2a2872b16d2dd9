"""A quantity over the image: by the image height, 0 in the image's middle and 1 at its corner, from rows of a table."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from scenes.materials.vectors import NUMPY, Ops

Rows = tuple[tuple[float, float], ...]


class Piece(NamedTuple):
    """Where in the squared height a polynomial begins, how far it goes on, and its coefficients from the first on."""

    start: float
    width: float
    coefficients: tuple[float, ...]


def at_height(pieces: tuple[Piece, ...], height2: Any, ops: Ops = NUMPY) -> Any:
    """1 in the middle, and what the pieces add up to a squared height; written with ``ops``, as a material's formulas.

    >>> float(at_height((Piece(0.0, 1.0, (0.5, 0.25)),), 0.25))
    1.140625
    """
    total = 1.0 + 0 * height2
    for start, width, coefficients in pieces:
        t = ops.minimum(ops.maximum(height2 - start, 0.0), width)
        rise = 0 * t
        for each in reversed(coefficients):
            rise = (rise + each) * t
        total = total + rise
    return total


@lru_cache(maxsize=64)
def between(rows: Rows) -> tuple[Piece, ...]:
    """A monotone cubic in the squared height (`scipy.interpolate.PchipInterpolator`) through rows [height, value].

    From 1 in the middle on; beyond the last row as in it.
    """
    rows = rows if rows and rows[0][0] == 0 else ((0.0, 1.0), *rows)
    if len(rows) < 2:
        return ()
    from scipy.interpolate import PchipInterpolator  # slow to load, and rarely needed

    height2 = np.array(rows)[:, 0] ** 2
    cubic = PchipInterpolator(height2, np.array(rows)[:, 1])
    return tuple(
        Piece(float(start), float(width), tuple(map(float, cubic.c[-2::-1, i])))
        for i, (start, width) in enumerate(zip(height2[:-1], np.diff(height2), strict=True))
    )


def outward(key: str, rows: Rows) -> Rows:
    """The rows of a table over the image, once they are known to be 1 in the middle and to rise in height.

    Raises
    ------
    ValueError
        If they do not.
    """
    if any(a[0] >= b[0] for a, b in pairwise(rows)):
        raise ValueError(f"{key} must be rows of rising image height, got {[row[0] for row in rows]}")
    if rows and rows[0][0] == 0 and rows[0][1] != 1:
        raise ValueError(f"{key} must be 1 in the middle, got {rows[0][1]:g}")
    return rows
