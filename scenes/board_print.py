"""What is printed on a board: outlines of what is dark, triangles of bright and dark, in ways from point to point."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from scenes.markers import bright_cells

if TYPE_CHECKING:
    from scenes.board import Board

AROUND = 32  # sides of the polygon that stands for a dot in images; its area is the circle's
_ROUNDED = np.sqrt(2 * np.pi / AROUND / np.sin(2 * np.pi / AROUND))  # of its radius, which makes the area the circle's
_SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])


@lru_cache(maxsize=16)
def numbered(columns: int, rows: int) -> np.ndarray:
    """Column and row of each point of a board, row by row, (n, 2); to be read alone."""
    found = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2).astype(float)
    found.setflags(write=False)
    return found


def marker_corners(columns: int, rows: int, share: float) -> np.ndarray:
    """Four corners of each marker of a grid, row by row, (n, 4, 2); a side is such a share of the way to the next."""
    return numbered(columns, rows)[:, None] + share * numbered(2, 2)


def dark_outlines(board: Board) -> np.ndarray:
    """Corners (m, k, 2) of what is dark, counterclockwise; dots as polygons of the same area. A marker's bright cells
    lie in its dark square, clockwise."""
    if board.kind == "dots":
        return numbered(*board.shape)[:, None] + _polygon(board.radius / board.pitch)
    if board.kind == "chessboard":
        return _quads(*board.shape, 0)
    squares, bright, _ = _markers(board)
    printed = np.concatenate([squares, bright[:, ::-1]])
    return printed if board.kind == "markers" else np.concatenate([_quads(*board.shape, int(board.before)), printed])


def triangles(board: Board) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (T, 3, 2) of what is bright and of what is dark, which cover it once; dots as polygons of the same
    area."""
    if board.kind == "dots":
        return _dots(*board.shape, board.radius / board.pitch)
    if board.kind == "chessboard":
        return _squares(*board.shape)
    return (_tags if board.kind == "markers" else _charuco)(board, *_markers(board))


def _squares(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Of bright and dark squares; that before the first inner corner is dark."""
    bright = np.concatenate([_quads(columns, rows, 1), _border((-2.0, columns + 1.0), (-2.0, rows + 1.0), 1.0)])
    return _halves(bright), _halves(_quads(columns, rows, 0))


def _charuco(board: Board, marked, bright, dark) -> tuple[np.ndarray, np.ndarray]:
    """The same of a board with markers in its squares: their outlines, and their bright and dark cells."""
    columns, rows = board.shape
    outer = _border((-2.0, columns + 1.0), (-2.0, rows + 1.0), 1.0)
    bright = np.concatenate([bright, *_about(marked, (1 - board.share) / 2), outer])
    return _halves(bright), _halves(np.concatenate([_quads(columns, rows, int(board.before)), dark]))


def _tags(board: Board, marked, bright, dark) -> tuple[np.ndarray, np.ndarray]:
    """The same of markers alone."""
    beside = (1 - board.share) / 2
    across, down = board.outer[[0, 2]].T.tolist()
    bright = np.concatenate([bright, *_about(marked, beside), _border(across, down, 0.5 - beside)])
    return _halves(bright), _halves(dark)


def _markers(board: Board) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Outlines (n, 4, 2) of a board's markers, and of their bright and dark cells; numbered from the upper left."""
    first = _first_corners(board)
    cells = bright_cells(board.dictionary or "", board.markers)
    count = cells.shape[1]

    def outlines(which: np.ndarray) -> np.ndarray:
        number, row, column = np.nonzero(which)
        at = np.stack([column, count - 1 - row], -1)[:, None] + _SQUARE
        return first[number, None] + board.share / count * at

    return first[:, None] + board.share * _SQUARE, outlines(cells), outlines(~cells)


def _first_corners(board: Board) -> np.ndarray:
    """Of a board's markers, (n, 2)."""
    columns, rows = board.shape
    if board.kind == "markers":
        return numbered(columns, rows) * (1, -1) + (0, rows - 1)
    x, y = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    there = (x + y) % 2 == 1
    return np.stack([x[there] - 1, rows - y[there] - 1], -1) + (1 - board.share) / 2


def _about(squares: np.ndarray, beside: float) -> list[np.ndarray]:
    """What is bright about each of some squares (n, 4, 2), so wide."""
    ends = np.stack([squares[:, 0] - beside, squares[:, 2] + beside], -1)
    return [_border((x0, x1), (y0, y1), beside) for (x0, x1), (y0, y1) in ends.tolist()]


def _border(across: tuple[float, float], down: tuple[float, float], wide: float) -> np.ndarray:
    """Four rectangles (4, 4, 2) that are the border of one from end to end in x and y."""
    (a, b), (c, d) = across, down
    bars = [
        (a, c, b, c + wide),
        (a, d - wide, b, d),
        (a, c + wide, a + wide, d - wide),
        (b - wide, c + wide, b, d - wide),
    ]
    return np.array([[(x, y), (u, y), (u, v), (x, v)] for x, y, u, v in bars])


def _quads(columns: int, rows: int, odd: int) -> np.ndarray:
    """Squares (m, 4, 2) of one shade: of even or odd sums of their first corner."""
    first = numbered(columns + 1, rows + 1) - 1
    return (first[:, None] + _SQUARE)[first.sum(1) % 2 == odd]


def _polygon(radius: float) -> np.ndarray:
    """The dot of a radius in ways from one to the next, (AROUND, 2)."""
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    return _ROUNDED * radius * np.stack([np.cos(angle), np.sin(angle)], -1)


def _halves(quads: np.ndarray) -> np.ndarray:
    """Two triangles of each convex quadrilateral (n, 4, 2)."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _dots(columns: int, rows: int, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of what is between polygons for dots, and of these; a margin of half a pitch beside the outer cells."""
    inner, round_ = _polygon(radius), _polygon(1.0)
    outer = 0.5 * round_ / np.abs(round_).max(1, keepdims=True)
    following = np.roll(np.arange(AROUND), -1)
    ring = _halves(np.stack([inner, outer, outer[following], inner[following]], 1))
    fan = np.stack([np.zeros_like(inner), inner, inner[following]], 1)
    at = numbered(columns, rows)[:, None, None]
    margin = _halves(_border((-1.0, float(columns)), (-1.0, float(rows)), 0.5))
    return np.concatenate([(at + ring).reshape(-1, 3, 2), margin]), (at + fan).reshape(-1, 3, 2)
