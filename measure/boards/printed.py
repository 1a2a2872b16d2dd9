"""What may be printed on a board, and how each kind is measured in an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from measure.boards.charuco import charuco, charuco_boards
from measure.boards.chessboard import Board, check_shape, chessboard
from measure.boards.dots import dot_grid
from measure.boards.marker_grid import check_grid, marker_grid

CHESSBOARD, DOTS, CHARUCO, MARKERS = "chessboard", "dots", "charuco", "markers"


@dataclass(frozen=True)
class Printed:
    """A kind of board, and how large it is.

    Attributes
    ----------
    kind : str
        ``chessboard``, ``dots``, ``charuco`` or ``markers``.
    shape : (columns, rows), optional
        Inner corners, dots or markers; counted when not given, which no board with markers allows.
    dictionary : str
        Of the markers, if there are any.
    marker : float
        Their side over that of the squares, or over the way from one to the next.
    """

    kind: str = CHESSBOARD
    shape: tuple[int, int] | None = None
    dictionary: str = ""
    marker: float = 0.0

    def check(self) -> None:
        """See that there is such a board.

        Raises
        ------
        InvalidInput
            If not.
        """
        if self.kind == CHARUCO:
            charuco_boards(self.shape, self.dictionary, self.marker)
        elif self.kind == MARKERS:
            check_grid(self.shape, self.dictionary, self.marker)
        else:
            check_shape(self.shape)

    def measured(self, image: Any, noise: float | None = None) -> Board:
        """The board in an image, as `measure.chessboard` and its like measure it.

        Raises
        ------
        InvalidInput
            If the image shows none.
        """
        if self.kind in (CHARUCO, MARKERS):
            look = charuco if self.kind == CHARUCO else marker_grid
            return look(image, self.shape, self.dictionary, self.marker, noise)
        return (dot_grid if self.kind == DOTS else chessboard)(image, self.shape, noise)
