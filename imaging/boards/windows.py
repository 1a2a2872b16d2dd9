"""Which pixels tell of each corner of a board: disjoint windows, each up to half way to the next corners."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from scenes.board_print import numbered

_HALF = 0.48  # of the way to the next corner
_REACH = 12.0  # px from the corner; edges are parabolas so far
_BAND = 5.0  # px beside an edge: further away only levels are told
FEWEST = 40  # pixels of a window that can be fitted
_NARROWEST = 3.0  # px: half a square
_FOUR = 4  # points of a homography
INWARD = np.array([(1, 1), (-1, 1), (1, -1), (-1, -1)])
"""Into a marker from each of its corners, row by row."""
_CLEAR = 3.0  # standard deviations of blur and pixel: 0.13 % of a marker's contrast is left


@dataclass(frozen=True)
class Marked:
    """Markers in every second square, of which a window keeps clear: they are no part of a corner's image.

    Attributes
    ----------
    gap : float
        From a square's sides to its marker, in squares.
    first : bool
        Whether the square before the first inner corner has one.
    """

    gap: float
    first: bool = False

    def beyond(self, grid: np.ndarray, pixels: np.ndarray) -> np.ndarray:
        """How far pixels (n, m, 2) about each of the corners ``grid`` are past the gap along rows and columns, in
        squares, (n, m, 2); minus infinity where no marker's square is."""
        import cv2  # slow to load, and rarely needed

        rows, columns = grid.shape[:2]
        places = numbered(columns, rows)
        corners, seen = grid.reshape(-1, 2), np.isfinite(grid).all(-1).ravel()
        matrix = cv2.findHomography(corners[seen], places[seen])[0] if seen.sum() >= _FOUR else None
        if matrix is None:
            return np.full(pixels.shape, np.inf)
        away = _projected(matrix, pixels) - _projected(matrix, corners)[:, None]
        marked = (away.prod(-1) > 0) == (places.sum(1) % 2 == (0 if self.first else 1))[:, None]
        return np.where(marked[..., None], np.abs(away) - self.gap, -np.inf)


def _projected(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    import cv2  # as above

    return cv2.perspectiveTransform(points.reshape(1, -1, 2), matrix).reshape(points.shape)


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
    """From each corner to the next along its row and its column, px, shape (rows, columns, 2, 2) with the directions in
    the last but one axis: the mean of the steps from the one before and to the one behind, of those that are seen."""
    with warnings.catch_warnings(action="ignore"):  # of corners without neighbours
        return np.stack([np.nanmean(_both(np.diff(grid, axis=axis), axis), 0) for axis in (1, 0)], 2)


def _both(step: np.ndarray, axis: int) -> np.ndarray:
    """Steps (2, rows, columns, 2) to the next corner and from the last one; NaN where there is none."""
    none = np.full_like(np.take(step, [0], axis), np.nan)
    return np.stack([np.concatenate([step, none], axis), np.concatenate([none, step], axis)])


def windows(image: np.ndarray, grid: np.ndarray, marked: Marked | None = None, blur: float = 0.0) -> Windows:
    """Of corners at about ``grid``, shape (rows, columns, 2), px; row by row; without room where it is NaN.

    Of markers they keep clear as far as a lens of such a blur, px, spreads these.
    """
    seen = _Around.of(image, grid.reshape(-1, 2), steps(grid).reshape(-1, 2, 2))
    own, room = (np.abs(seen.away) < _HALF).all(-1), np.ones(len(seen.apart), bool)
    if marked:
        clear = _clear(blur)
        own &= (marked.beyond(grid, seen.pixels) * seen.apart[:, None] < -clear).any(-1)
        room = marked.gap * seen.apart.min(1) > clear
    return seen.packed(image, own, room)


def wedges(image: np.ndarray, quads: np.ndarray, gap: float, cell: float, blur: float) -> Windows:
    """Of the outer corners of dark markers, each the corner of one dark square; marker by marker.

    They reach half way to the next marker, half way along its sides, and as far into it as its dark border does, clear
    of what lies behind.

    Parameters
    ----------
    image : ndarray, shape (height, width)
    quads : ndarray, shape (n, 2, 2, 2)
        About where the markers' corners are, row by row, px; NaN where one is not seen.
    gap, cell : float
        From marker to marker, and width of a marker's border, in sides of a marker.
    blur : float
        Of the lens, px.
    """
    toward = np.array([steps(quad) for quad in quads]).reshape(-1, 2, 2)
    seen = _Around.of(image, quads.reshape(-1, 2), toward)
    into = seen.away * np.tile(INWARD, (len(quads), 1))[:, None]
    clear, apart = _clear(blur), seen.apart[:, None]
    own = ((into < _HALF) & (into > -gap / 2) & ((into + gap) * apart > clear)).all(-1)
    own &= ((into < 0) | ((into - cell) * apart < -clear)).any(-1)
    return seen.packed(image, own, min(gap, cell) * seen.apart.min(1) > clear)


def _clear(blur: float) -> float:
    """px from what is dark to where no more than `_CLEAR` standard deviations of its image reach."""
    return float(_CLEAR * np.hypot(blur, 12**-0.5))


@dataclass(frozen=True, eq=False)
class _Around:
    """Pixels about n corners: their places (n, m, 2), px; how far along both directions from the corner, in ways to the
    next one, (n, m, 2); and px of such a way across the other direction, (n, 2)."""

    pixels: np.ndarray
    away: np.ndarray
    apart: np.ndarray

    @classmethod
    def of(cls, image: np.ndarray, corners: np.ndarray, toward: np.ndarray) -> _Around:
        """Of corners (n, 2) whose ways to the next ones are (n, 2, 2)."""
        reach = int(_REACH)
        offset = np.stack(np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1)), -1).reshape(-1, 2)
        pixels = np.rint(corners)[:, None] + offset
        away = pixels - corners[:, None]
        with np.errstate(all="ignore"):
            area = toward[:, 0, 0] * toward[:, 1, 1] - toward[:, 0, 1] * toward[:, 1, 0]
            along = (away[..., 0] * toward[:, None, 1, 1] - away[..., 1] * toward[:, None, 1, 0]) / area[:, None]
            down = (away[..., 1] * toward[:, None, 0, 0] - away[..., 0] * toward[:, None, 0, 1]) / area[:, None]
            apart = np.abs(area)[:, None] / np.linalg.norm(toward, axis=-1)[:, ::-1]
        return cls(pixels, np.stack([along, down], -1), apart)

    def packed(self, image: np.ndarray, own: np.ndarray, room: np.ndarray) -> Windows:
        """Windows of their own pixels (n, m) beside an edge, of those corners (n,) that may have room."""
        height, width = image.shape
        with np.errstate(invalid="ignore"):
            own = own & (np.abs(self.away) * self.apart[:, None] < _BAND).any(-1)
            room = room & (self.apart.min(1) / 2 >= _NARROWEST)
        inside = ((self.pixels >= 0) & (self.pixels < [width, height])).all(-1)
        room &= ~(own & ~inside).any(1)
        there = _disjoint(own & inside & room[:, None], self.pixels, width)
        room &= there.sum(1) >= FEWEST
        return _packed(image, self.pixels, there, room)


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
