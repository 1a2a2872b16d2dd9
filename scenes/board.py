"""A board of stated geometry that stands beside the part, is seen with it, and tells where both lie."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.markers import bright_cells
from scenes.model import Model
from scenes.ranges import Coordinate, Fraction, Length, Spread

PITCH = "placement.board.pitch"
"""Key of the one number of a board that may carry an uncertainty."""
Vector = tuple[Coordinate, Coordinate, Coordinate]
_MARKER = 0.7  # of a square: a marker's side
_SKEW = 1e-6  # cosine of the angle between the directions that a board may have
AROUND = 32  # sides of the polygon that stands for a dot in images; its area is the circle's
_ROUNDED = np.sqrt(2 * np.pi / AROUND / np.sin(2 * np.pi / AROUND))  # of its radius, which makes the area the circle's


class Board(Model):
    """A plane with a chessboard's squares or a grid of dots, rigidly beside the part.

    Its points are the chessboard's inner corners, or the middles of the dots: row by row from ``corner``. A ChArUco
    board is a chessboard with markers in its bright squares; upright, with ``along`` to the right, ``corner`` is at
    its lower left.
    """

    kind: Literal["chessboard", "dots", "charuco"] = "chessboard"
    """What is printed on it."""
    shape: tuple[Annotated[int, Field(ge=3, le=200)], Annotated[int, Field(ge=3, le=200)]]
    """Columns and rows of inner corners, or of dots."""
    pitch: Length
    """From one point to the next [length]."""
    corner: Vector
    """Where the first point is [length]."""
    along: Vector = (1.0, 0.0, 0.0)
    """Direction of its rows."""
    normal: Vector = (0.0, 0.0, 1.0)
    """Towards where it is looked at from; the columns run along normal x along."""
    dot_radius: Length | None = None
    """Of dots, which are dark; a quarter of the pitch if left out [length]."""
    dictionary: str | None = None
    """Of a ChArUco board's markers, by OpenCV's name, as DICT_5X5_100."""
    marker: Length | None = None
    """Side of its markers; 0.7 of the pitch if left out [length]."""
    bright: Fraction = 0.8
    """Reflectance of what is bright: a diffuse surface."""
    dark: Fraction = 0.05
    """Reflectance of what is dark."""
    point_sd: Spread = 0.0
    """Standard uncertainty of each point's place, in all three directions independently: print and flatness
    [length]."""

    @model_validator(mode="after")
    def _possible(self) -> Board:
        along, normal = np.array(self.along), np.array(self.normal)
        lengths = np.linalg.norm(along), np.linalg.norm(normal)
        if not min(lengths) > 0:
            raise ValueError("along and normal must be directions, got 0")
        if abs(float(along @ normal)) > _SKEW * lengths[0] * lengths[1]:
            raise ValueError(f"normal must be across along, got {list(self.normal)} and {list(self.along)}")
        if not self.dark < self.bright:
            raise ValueError(f"dark must be less than bright, {self.bright:g}, got {self.dark:g}")
        if self.kind != "dots" and self.dot_radius is not None:
            raise ValueError(f"dot_radius must be left out of a {self.kind}, got {self.dot_radius:g}")
        if self.kind == "dots" and not self.radius < 0.45 * self.pitch:
            raise ValueError(f"dot_radius must be less than 0.45 of pitch, {self.pitch:g}, got {self.radius:g}")
        self._check_markers()
        return self

    def _check_markers(self) -> None:
        if self.kind != "charuco":
            given = self.dictionary if self.marker is None else f"{self.marker:g}"
            if given is not None:
                raise ValueError(f"dictionary and marker must be left out of a {self.kind}, got {given}")
            return
        if not self.share < 1:
            raise ValueError(f"marker must be less than pitch, {self.pitch:g}, got {self.marker:g}")
        bright_cells(self.dictionary or "", (self.shape[0] + 1) * (self.shape[1] + 1) // 2)

    @property
    def share(self) -> float:
        """Side of a ChArUco board's markers over that of its squares."""
        return _MARKER if self.marker is None else self.marker / self.pitch

    @property
    def before(self) -> bool:
        """Whether the square before its first point is bright: a ChArUco board's upper left one is dark."""
        return self.kind == "charuco" and self.shape[1] % 2 == 1

    @property
    def radius(self) -> float:
        """Of the dots."""
        return self.pitch / 4 if self.dot_radius is None else self.dot_radius

    @property
    def count(self) -> int:
        """Number n of its points."""
        return self.shape[0] * self.shape[1]

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors along rows, along columns, and its normal, shape (3, 3).

        >>> Board(shape=(4, 3), pitch=5, corner=(0, 0, 0)).axes.tolist()
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        """
        along, normal = (np.array(each) / np.linalg.norm(each) for each in (self.along, self.normal))
        return np.stack([along, np.cross(normal, along), normal])

    def at(self, places: np.ndarray) -> np.ndarray:
        """Points (..., 3) of places (..., 2) on it, columns and rows from its first point."""
        return np.array(self.corner) + self.pitch * np.asarray(places, float) @ self.axes[:2]

    @property
    def points(self) -> np.ndarray:
        """Its points, row by row, shape (n, 3), the scene's unit."""
        return self.at(numbered(*self.shape))

    @property
    def by_pitch(self) -> np.ndarray:
        """Derivative of its points by its pitch, shape (n, 3): the first one stays."""
        return (self.points - np.array(self.corner)) / self.pitch

    @property
    def outer(self) -> np.ndarray:
        """Places of its own corners, counterclockwise, (4, 2): a bright border a pitch wide beyond squares or dots."""
        x, y = self.shape
        if self.kind != "dots":
            return np.array([(-2.0, -2.0), (x + 1, -2), (x + 1, y + 1), (-2, y + 1)])
        return np.array([(-1.0, -1.0), (x, -1), (x, y), (-1, y)])

    @property
    def outline(self) -> np.ndarray:
        """The same in space, (4, 3)."""
        return self.at(self.outer)

    @property
    def size(self) -> tuple[float, float]:
        """Lengths of its own sides, along rows and along columns, the scene's unit."""
        across, down = self.pitch * (self.outer[2] - self.outer[0])
        return float(across), float(down)

    @property
    def dark_polygons(self) -> np.ndarray:
        """Corners (m, k, 2) of what is dark, places on the board, counterclockwise; dots as polygons of the same
        area. A marker's bright cells lie in its dark square, clockwise."""
        if self.kind == "charuco":
            squares, bright = _markers(*self.shape, self.dictionary, self.share)[:2]
            return np.concatenate([_quads(*self.shape, int(self.before)), squares, bright[:, ::-1]])
        if self.kind == "chessboard":
            return _quads(*self.shape, 0)
        return numbered(*self.shape)[:, None] + _polygon(self.radius / self.pitch)

    @property
    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Triangles (T, 3, 3) of what is bright and of what is dark, which cover it once; dots as polygons of the same
        area."""
        bright, dark = (self.at(part) for part in self._made())
        return bright, dark

    def _made(self) -> tuple[np.ndarray, np.ndarray]:
        if self.kind == "dots":
            return _dots(*self.shape, self.radius / self.pitch)
        if self.kind == "chessboard":
            return _squares(*self.shape)
        return _charuco(*self.shape, int(self.before), *_markers(*self.shape, self.dictionary, self.share))


@lru_cache(maxsize=16)
def numbered(columns: int, rows: int) -> np.ndarray:
    """Column and row of each point of a board, row by row, (n, 2); to be read alone."""
    found = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2).astype(float)
    found.setflags(write=False)
    return found


def _squares(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (T, 3, 2) of bright and dark squares; that before the first inner corner is dark."""
    bright = np.concatenate([_quads(columns, rows, 1), _border((-2.0, columns + 1.0), (-2.0, rows + 1.0), 1.0)])
    return _halves(bright), _halves(_quads(columns, rows, 0))


def _charuco(columns: int, rows: int, odd: int, marked, bright, dark) -> tuple[np.ndarray, np.ndarray]:
    """The same of a board with markers: their squares, and their bright and dark cells."""
    square = np.floor(marked[:, 0])
    around = [
        _border((x, x + 1.0), (y, y + 1.0), low)
        for (x, y), low in zip(square, (marked[:, 0] - square)[:, 0], strict=True)
    ]
    bright = np.concatenate([bright, *around, _border((-2.0, columns + 1.0), (-2.0, rows + 1.0), 1.0)])
    return _halves(bright), _halves(np.concatenate([_quads(columns, rows, odd), dark]))


def _markers(columns: int, rows: int, dictionary: str, share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Outlines (n, 4, 2) of a board's markers, and of their bright and dark cells; numbered from the upper left."""
    x, y = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    there = (x + y) % 2 == 1
    first = np.stack([x[there] - 1, rows - y[there] - 1], -1) + (1 - share) / 2
    cells = bright_cells(dictionary, len(first))
    side, count = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]), cells.shape[1]

    def outlines(which: np.ndarray) -> np.ndarray:
        number, row, column = np.nonzero(which)
        at = np.stack([column, count - 1 - row], -1)[:, None] + side
        return first[number, None] + share / count * at

    return first[:, None] + share * side, outlines(cells), outlines(~cells)


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
    return (first[:, None] + np.array([(0, 0), (1, 0), (1, 1), (0, 1)]))[first.sum(1) % 2 == odd]


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
