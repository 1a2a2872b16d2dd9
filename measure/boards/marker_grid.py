"""A grid of square markers in an image, ArUco's or AprilTags: the four corners of each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from imaging.boards.windows import Windows, steps, wedges
from measure.boards.bend import bends_at
from measure.boards.charuco import check_marker
from measure.boards.chessboard import Board, check_shape, measured
from measure.boards.noise import check_noise
from measure.boards.reading import Legible
from scenes.arrays import picture
from scenes.board_print import marker_corners
from scenes.errors import InvalidInput
from scenes.markers import read_dictionary

_NEAR = 0.35  # of the gap: further off it is another corner
_CLOCKWISE = [0, 1, 3, 2]  # of OpenCV's corners of a marker, row by row
_ASTRAY = 0.5  # of a side: further from where the others say a marker is another one, or none


def marker_grid(
    image: Any, shape: tuple[int, int], dictionary: str, marker: float, noise: float | None = None
) -> Board:
    """Measure the corners of the markers of a grid in an image, which may show a part of it.

    OpenCV reads the markers and tells roughly where their corners are. A marker's outer corner is that of its dark
    border: the crossing of its two sides, with levels linear in place in all four quadrants of which one is dark. The
    window ends half way to the next marker, and within the border before what is printed behind it.

    Parameters
    ----------
    image : array_like, shape (height, width)
        Grey levels.
    shape : (columns, rows)
        Markers of the whole grid.
    dictionary : str
        By OpenCV's name: DICT_5X5_100, DICT_APRILTAG_36h11. Markers are numbered from 0, row by row.
    marker : float
        Side of a marker over the way from one to the next.
    noise : float, optional
        Standard deviation of white noise, grey levels; from the image when not given.

    Raises
    ------
    InvalidInput
        If there is no such grid in the image, or an argument is bad.
    """
    image = picture(image)
    check_noise(noise)
    known = check_grid(shape, dictionary, marker)
    columns, rows = shape
    layout = Markers(float(marker), known.markerSize + 2, columns, rows)
    grid = layout.sorted(_seen(Legible.of(image), known))
    if not np.isfinite(grid).any():
        raise InvalidInput(f"image must show a grid of {columns} x {rows} markers of {dictionary}, got none of them")
    return replace(measured(image, grid, noise, layout), marker=float(marker))


def check_grid(shape: Any, dictionary: Any, marker: Any) -> cv2.aruco.Dictionary:
    """The dictionary of a grid, if there is such a one.

    Raises
    ------
    InvalidInput
        If not.
    """
    if shape is None:
        raise InvalidInput("shape must be columns and rows of markers, got none")
    columns, rows = check_shape(shape, "markers", 1)
    check_marker(marker)
    return read_dictionary(dictionary, columns * rows)


@dataclass(frozen=True)
class Markers:
    """Corners of markers beside one another: a grid (rows, columns, 2, 2, 2).

    Attributes
    ----------
    side : float
        Of a marker, over the way from one to the next.
    cells : int
        Along a side, with the border's.
    columns, rows : int
    """

    side: float
    cells: int
    columns: int
    rows: int

    @property
    def places(self) -> np.ndarray:
        """Of the markers' corners on the board, in ways from one marker to the next, shape (n, 4, 2)."""
        return marker_corners(self.columns, self.rows, self.side)

    def sorted(self, seen: list[tuple[int, np.ndarray]]) -> np.ndarray:
        """The grid of markers that are seen, (number, corners (4, 2), clockwise) each; NaN where none is.

        A number that is read twice, and a marker that lies where a plane board cannot have it, are no part of it.
        """
        numbers = [number for number, _ in seen]
        grid = np.full((self.rows * self.columns, 4, 2), np.nan)
        for number, corners in seen:
            if number < len(grid) and numbers.count(number) == 1:
                grid[number] = corners[_CLOCKWISE]
        there = np.isfinite(grid).all((1, 2))
        if there.sum() > 1:
            limit = _ASTRAY * float(np.median(np.linalg.norm(grid[there, 1] - grid[there, 0], axis=-1)))
            matrix = cv2.findHomography(
                self.places[there].reshape(-1, 2), grid[there].reshape(-1, 2), cv2.RANSAC, limit
            )[0]
            if matrix is not None:
                off = cv2.perspectiveTransform(self.places.reshape(1, -1, 2), matrix).reshape(grid.shape) - grid
                grid[~(np.linalg.norm(off, axis=-1) < limit).all(1)] = np.nan
        return grid.reshape(self.rows, self.columns, 2, 2, 2)

    @property
    def gap(self) -> float:
        """Between markers, in their sides."""
        return (1 - self.side) / self.side

    @property
    def near(self) -> float:
        """Share of a side: further off it is another corner."""
        return _NEAR * min(self.gap, 1.0)

    def steps(self, grid: np.ndarray) -> np.ndarray:
        """Along the marker's sides."""
        return np.array([steps(quad) for quad in grid.reshape(-1, 2, 2, 2)]).reshape(-1, 2, 2)

    def windows(self, image: np.ndarray, grid: np.ndarray, blur: float) -> Windows:
        """Up to the next marker, and to what is printed within."""
        return wedges(image, grid.reshape(-1, 2, 2, 2), self.gap, 1 / self.cells, blur)

    def bends(self, grid: np.ndarray) -> np.ndarray:
        """Told by all corners together."""
        return bends_at(self.places.reshape(-1, 2), grid.reshape(-1, 2), self.steps(grid))


def _seen(legible: Legible, known: cv2.aruco.Dictionary) -> list[tuple[int, np.ndarray]]:
    """Numbers and corners (4, 2), clockwise, of the markers in an image."""
    legible.parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
    corners, numbers, _ = cv2.aruco.ArucoDetector(known, legible.parameters).detectMarkers(legible.grey)
    if numbers is None:
        return []
    return [(int(number), legible.back(four[0])) for number, four in zip(numbers.ravel(), corners, strict=True)]
