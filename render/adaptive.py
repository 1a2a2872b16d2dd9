"""Many rays only where an edge crosses: fine pixels that differ from a neighbour are rendered again."""

from __future__ import annotations

import itertools
from typing import Any

import cv2
import numpy as np

from render.rays import Rays

MISSED = 0.25  # of the brightest: so far is a fine pixel whose one ray missed the tip of a corner from a refined one
STEP = 0.01  # part of the brightest pixel that a neighbour must differ by; shading varies by less over a fine pixel


def places(mask: np.ndarray) -> np.ndarray:
    """Rows and columns of marked pixels, (2, n), as ``np.nonzero`` in a tenth of its time: masks of large images are
    asked often.

    >>> places(np.array([[False, True], [True, False]]))
    array([[0, 1],
           [1, 0]])
    """
    return np.stack(np.divmod(np.flatnonzero(mask), mask.shape[1]))


def dilated(mask: np.ndarray, size: int) -> np.ndarray:
    """A mask and what lies in a square of so many pixels, an odd number, around it.

    >>> dilated(np.array([[False, False, True, False]]), 3)
    array([[False,  True,  True,  True]])
    """
    return cv2.dilate(mask.view(np.uint8), np.ones((size, size), np.uint8)).view(bool)


def crossed(fine: np.ndarray, reach: int = 0, step: float = STEP, where: np.ndarray | None = None) -> np.ndarray:
    """Fine pixels that differ from one of their eight neighbours, as a mask; with others within ``reach`` of them.

    ``step`` is the part of the brightest pixel that they must differ by. Only pixels of the mask ``where`` are asked,
    all if it is not given.

    >>> crossed(np.array([[0.0, 0, 0, 1, 1, 1]])).astype(int)
    array([[0, 0, 1, 1, 0, 0]])
    """
    least = step * max(float(fine.max()), np.finfo(float).tiny)
    if where is None:
        around = np.ones((3, 3), np.uint8)
        marked = cv2.dilate(fine, around) - cv2.erode(fine, around) > least
    else:
        marked = np.zeros(fine.shape, bool)
        marked[where] = _span(fine, where) > least
    return dilated(marked, 2 * reach + 1) if reach else marked


def _span(fine: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Largest less smallest of each marked pixel and its eight neighbours, of a border's as many as there are."""
    rows, columns = (
        [np.clip(at + off, 0, size - 1) for off in (-1, 0, 1)]
        for at, size in zip(places(where), fine.shape, strict=True)
    )
    low = high = fine[where]
    for row, column in itertools.product(rows, columns):
        beside = fine.take(row * fine.shape[1] + column)
        low, high = np.minimum(low, beside), np.maximum(high, beside)
    return high - low


def bent(fine: np.ndarray, step: float = STEP) -> np.ndarray:
    """Fine pixels at which, or beside which, brightness does not run on evenly, as a mask: not those of a slope alone.

    >>> bent(np.array([[0.0, 1, 2, 3, 4, 60, 60, 60, 60]]), 0.1).astype(int)
    array([[0, 0, 0, 1, 1, 1, 1, 0, 0]])
    """
    wide = np.pad(fine, 1, mode="reflect", reflect_type="odd") if min(fine.shape) > 1 else np.pad(fine, 1, mode="edge")
    rows, columns = fine.shape

    def beside(y: int, x: int) -> np.ndarray:
        return wide[1 + y : 1 + y + rows, 1 + x : 1 + x + columns]

    ways = (0, 1), (1, 0), (1, 1), (1, -1)
    bend = np.max([np.abs(beside(y, x) + beside(-y, -x) - 2 * fine) for y, x in ways], axis=0)
    return dilated(bend > step * max(float(fine.max()), np.finfo(float).tiny), 3)


def refine(scene: Any, rays: Rays, fine: np.ndarray, marked: np.ndarray, samples: int) -> np.ndarray:
    """The image with its marked fine pixels rendered again, ``samples`` (a square number) stratified rays each.

    Parameters
    ----------
    scene : mitsuba.Scene
        Of a compiled variant, which traces all rays as one array.
    rays : Rays
    fine : ndarray
        The image as rendered so far.
    marked : ndarray of bool
    samples : int
    """
    result = fine.copy()
    result[marked] = rays.radiance(scene, *places(marked), fine.shape, samples)
    return result
