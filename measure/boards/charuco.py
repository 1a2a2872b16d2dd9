"""A ChArUco board in an image: a chessboard whose white squares hold markers, so that each corner is known by name."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from imaging.boards.windows import Marked
from measure.boards.chessboard import Board, Squares, check_shape, measured
from measure.boards.noise import check_noise
from measure.boards.reading import Legible
from scenes.arrays import picture
from scenes.errors import InvalidInput
from scenes.markers import read_dictionary

_FEWEST = 4  # corners


def charuco(image: Any, shape: tuple[int, int], dictionary: str, marker: float, noise: float | None = None) -> Board:
    """Measure the corners of the ChArUco board in an image, which may show a part of it.

    OpenCV reads the markers, tells which corners are seen and roughly where. Each is then measured as a chessboard's,
    in a window that keeps three standard deviations of the blur away from the markers beside it.

    Parameters
    ----------
    image : array_like, shape (height, width)
        Grey levels.
    shape : (columns, rows)
        Inner corners of the whole board: one less than squares.
    dictionary : str
        Of the markers, by OpenCV's name: DICT_5X5_100, DICT_APRILTAG_36h11. They are numbered from 0, row by row.
    marker : float
        Side of a marker over that of a square.
    noise : float, optional
        Standard deviation of white noise, grey levels; from the image when not given.

    Raises
    ------
    InvalidInput
        If there is no such board in the image, or an argument is bad.
    """
    image = picture(image)
    check_noise(noise)
    boards = charuco_boards(shape, dictionary, marker)
    grid, first = _approximate(image, boards)
    if grid is None:
        raise InvalidInput(
            f"image must show a ChArUco board of {shape[0]} x {shape[1]} inner corners and markers of {dictionary}, "
            "got none"
        )
    return measured(image, grid, noise, Squares(Marked((1 - float(marker)) / 2, first)))


def charuco_boards(shape: Any, dictionary: Any, marker: Any) -> tuple[cv2.aruco.CharucoBoard, ...]:
    """The boards of that description, squares of size 1: of an even number of rows of squares there are two, for
    before 4.6 OpenCV began these with a marker.

    Raises
    ------
    InvalidInput
        If there is none.
    """
    if shape is None:
        raise InvalidInput("shape must be columns and rows of inner corners, got none")
    columns, rows = check_shape(shape)
    check_marker(marker)
    needed = (columns + 1) * (rows + 1) // 2
    board = cv2.aruco.CharucoBoard((columns + 1, rows + 1), 1.0, float(marker), read_dictionary(dictionary, needed))
    if rows % 2 == 0:
        return (board,)
    older = cv2.aruco.CharucoBoard((columns + 1, rows + 1), 1.0, float(marker), board.getDictionary())
    older.setLegacyPattern(True)
    return board, older


def check_marker(marker: Any) -> None:
    """See that a marker's side over its square's is a number between.

    Raises
    ------
    InvalidInput
        If not.
    """
    number = isinstance(marker, int | float | np.number) and not isinstance(marker, bool)
    if not (number and 0 < marker < 1):
        raise InvalidInput(f"marker must be a number more than 0 and less than 1, got {marker!r}")


def _approximate(image: np.ndarray, boards: tuple[cv2.aruco.CharucoBoard, ...]) -> tuple[np.ndarray | None, bool]:
    """Corners (rows, columns, 2) to some tenths of a pixel, NaN where not seen; whether the first square has a marker.

    None if too few are seen.
    """
    legible = Legible.of(image)
    found = [_seen(legible, board) for board in boards]
    best = max(found, key=lambda each: np.isfinite(each[..., 0]).sum())
    if np.isfinite(best[..., 0]).sum() < _FEWEST:
        return None, False
    return best, best is not found[0]


def _seen(legible: Legible, board: cv2.aruco.CharucoBoard) -> np.ndarray:
    columns, rows = (n - 1 for n in board.getChessboardSize())
    grid = np.full((rows * columns, 2), np.nan)
    reader = cv2.aruco.CharucoDetector(board)
    reader.setDetectorParameters(legible.parameters)
    corners, numbers, _, _ = reader.detectBoard(legible.grey)
    if numbers is not None and len(numbers):
        grid[numbers.ravel()] = legible.back(corners.reshape(-1, 2))
    return grid.reshape(rows, columns, 2)
