"""Photographs of a board: measured one by one, those without a board named and left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import measure
from measure.boards.camera import FEWEST_BOARDS, FEWEST_CORNERS
from measure.boards.printed import Printed
from scenes import InvalidInput
from scenes.files import image as image_file

MOST_FILES = 1000


@dataclass(frozen=True)
class Boards:
    """What photographs show.

    Attributes
    ----------
    files : tuple of Path
        Those with a board.
    boards : tuple of Board
    left_out : tuple of (Path, str)
        The others, and why.
    image_shape : (height, width)
        Of all of them.
    """

    files: tuple[Path, ...]
    boards: tuple[measure.Board, ...]
    left_out: tuple[tuple[Path, str], ...]
    image_shape: tuple[int, int]


def read_boards(
    files: Sequence[Path],
    printed: Printed = Printed(),
    noise: float | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    size: image_file.Size | None = None,
) -> Boards:
    """Measure the board in each photograph; ``size`` is what they must have, else the first one's.

    Raises
    ------
    InvalidInput
        If photographs differ in size, or fewer than 3 show a board.
    """
    if not FEWEST_BOARDS <= len(files) <= MOST_FILES:
        raise InvalidInput(f"BOARD must be {FEWEST_BOARDS} to {MOST_FILES} photographs, got {len(files)}")
    found, left_out = {}, []
    for i, path in enumerate(files):
        try:
            image = image_file.read(path, size)
        except image_file.WrongSize:
            raise
        except InvalidInput as error:
            left_out.append((path, str(error)))
            continue
        size = size or image_file.Size(*image.shape, of=str(path))
        try:
            found[path] = _board(image, printed, noise)
        except InvalidInput as error:
            left_out.append((path, f"{path}: {error}"))
        if progress:
            progress("boards", i + 1, len(files))
    if len(found) < FEWEST_BOARDS:
        first = f"; {left_out[0][1]}" if left_out else ""
        raise InvalidInput(
            f"BOARD must be at least {FEWEST_BOARDS} photographs that show the board, "
            f"got {len(found)} of {len(files)}{first}"
        )
    return Boards(tuple(found), tuple(found.values()), tuple(left_out), size[:2])


def _board(image: np.ndarray, printed: Printed, noise: float | None) -> measure.Board:
    """That of one photograph, enough of whose corners can be measured."""
    board = printed.measured(image, noise)
    good = int(board.measured.sum())
    if good < FEWEST_CORNERS:
        raise InvalidInput(f"board must have {FEWEST_CORNERS} corners that can be measured, got {good}")
    return board
