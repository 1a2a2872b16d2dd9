"""Which pixels tell of each corner of a board: disjoint windows, each up to half way to the next corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_HALF = 0.48  # of the way to the next corner
_REACH = 12.0  # px from the corner; edges are parabolas so far
_BAND = 5.0  # px beside an edge: further away only levels are told
FEWEST = 40  # pixels of a window that can be fitted
_NARROWEST = 3.0  # px: half a square


@dataclass(frozen=True, eq=False)
class Windows:
    """Pixels of n corners, padded to the same number.

    Attributes
    ----------
    places : ndarray, shape (n, pixels, 2)
        (x, y), px, of pixels' centres.
    levels : ndarray, shape (n, pixels)
        Grey levels; 0 where there is no pixel.
    there : ndarray of bool, shape (n, pixels)
    room : ndarray of bool, shape (n,)
        Whether the window is wide enough and lies in the image.
    """

    places: np.ndarray
    levels: np.ndarray
    there: np.ndarray
    room: np.ndarray

    def some(self, which: np.ndarray) -> Windows:
        """Those of some corners."""
        return Windows(self.places[which], self.levels[which], self.there[which], self.room[which])


def steps(grid: np.ndarray) -> np.ndarray:
    """From each corner to the next along its row and its column, px: central differences, shape (rows, columns, 2, 2)
    with the directions in the last but one axis."""
    return np.stack([np.gradient(grid, axis=1), np.gradient(grid, axis=0)], 2)


def windows(image: np.ndarray, grid: np.ndarray) -> Windows:
    """Of corners at about ``grid``, shape (rows, columns, 2), px; row by row."""
    corners, toward = grid.reshape(-1, 2), steps(grid).reshape(-1, 2, 2)
    height, width = image.shape
    reach = int(_REACH)
    offset = np.stack(np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1)), -1).reshape(-1, 2)
    pixels = np.rint(corners)[:, None] + offset
    away = pixels - corners[:, None]
    length = np.linalg.norm(toward, axis=-1)
    with np.errstate(all="ignore"):
        area = toward[:, 0, 0] * toward[:, 1, 1] - toward[:, 0, 1] * toward[:, 1, 0]
        along = (away[..., 0] * toward[:, None, 1, 1] - away[..., 1] * toward[:, None, 1, 0]) / area[:, None]
        down = (away[..., 1] * toward[:, None, 0, 0] - away[..., 0] * toward[:, None, 0, 1]) / area[:, None]
        apart = np.abs(area)[:, None] / length  # from one edge to the next parallel one
        near = (np.abs(along) * apart[:, 1:] < _BAND) | (np.abs(down) * apart[:, :1] < _BAND)
        own = (np.abs(along) < _HALF) & (np.abs(down) < _HALF)
    inside = ((pixels >= 0) & (pixels < [width, height])).all(-1)
    room = (apart.min(1) / 2 >= _NARROWEST) & ~(own & near & ~inside).any(1)
    there = _disjoint(own & near & inside & room[:, None], pixels, width)
    room &= there.sum(1) >= FEWEST
    return _packed(image, pixels, there, room)


def _disjoint(there: np.ndarray, pixels: np.ndarray, width: int) -> np.ndarray:
    """A pixel that two windows want belongs to the first."""
    which = np.flatnonzero(there)
    flat = pixels.reshape(-1, 2)[which].astype(int)
    first = np.unique(flat[:, 1] * width + flat[:, 0], return_index=True)[1]
    kept = np.zeros(there.size, bool)
    kept[which[first]] = True
    return kept.reshape(there.shape)


def _packed(image: np.ndarray, pixels: np.ndarray, there: np.ndarray, room: np.ndarray) -> Windows:
    most = max(int(there.sum(1).max()), 1)
    order = np.argsort(~there, axis=1, kind="stable")[:, :most]
    there = np.take_along_axis(there, order, 1)
    places = np.take_along_axis(pixels, order[..., None], 1)
    x, y = np.where(there[..., None], places, 0).astype(int).transpose(2, 0, 1)
    return Windows(places, np.where(there, image[y, x], 0.0), there, room)
