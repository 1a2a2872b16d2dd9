"""A board of stated geometry that stands beside the part, is seen with it, and tells where both lie."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.board_print import dark_outlines, marker_corners, numbered, triangles
from scenes.markers import bright_cells
from scenes.model import Model
from scenes.ranges import Coordinate, Fraction, Length, Spread

PITCH = "placement.board.pitch"
"""Key of the one number of a board that may carry an uncertainty."""
Vector = tuple[Coordinate, Coordinate, Coordinate]
_FEWEST = 3  # points along a side without markers
_MARKER = 0.7  # of a square: a marker's side
_SKEW = 1e-6  # cosine of the angle between the directions that a board may have


class Board(Model):
    """A plane with a chessboard's squares, a grid of dots or of square markers (ArUco's, AprilTags), rigidly beside the
    part.

    Its points are the chessboard's inner corners, the middles of the dots, or the four corners of each marker: row by
    row from ``corner``. A ChArUco board is a chessboard with markers in its bright squares. A board with markers is
    upright with ``along`` to the right, ``corner`` at its lower left; its markers are numbered from 0, row by row from
    the upper left.
    """

    kind: Literal["chessboard", "dots", "charuco", "markers"] = "chessboard"
    """What is printed on it."""
    shape: tuple[Annotated[int, Field(ge=1, le=200)], Annotated[int, Field(ge=1, le=200)]]
    """Columns and rows of inner corners or dots, at least 3, or of markers."""
    pitch: Length
    """From one point, or marker, to the next [length]."""
    corner: Vector
    """Where the first point is [length]."""
    along: Vector = (1.0, 0.0, 0.0)
    """Direction of its rows."""
    normal: Vector = (0.0, 0.0, 1.0)
    """Towards where it is looked at from; the columns run along normal x along."""
    dot_radius: Length | None = None
    """Of dots, which are dark; a quarter of the pitch if left out [length]."""
    dictionary: str | None = None
    """Of the markers, by OpenCV's name, as DICT_5X5_100 or DICT_APRILTAG_36h11."""
    marker: Length | None = None
    """Side of the markers; 0.7 of the pitch if left out [length]."""
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
        if self.kind != "markers" and min(self.shape) < _FEWEST:
            raise ValueError(f"shape must be at least {_FEWEST} both ways of a {self.kind}, got {list(self.shape)}")
        self._check_markers()
        return self

    def _check_markers(self) -> None:
        if not self.has_markers:
            given = self.dictionary if self.marker is None else f"{self.marker:g}"
            if given is not None:
                raise ValueError(f"dictionary and marker must be left out of a {self.kind}, got {given}")
            return
        if not self.share < 1:
            raise ValueError(f"marker must be less than pitch, {self.pitch:g}, got {self.marker:g}")
        if self.kind == "markers" and self.markers < 2:
            raise ValueError(f"shape must be of at least 2 markers, got {list(self.shape)}")
        bright_cells(self.dictionary or "", self.markers)

    @property
    def has_markers(self) -> bool:
        """Whether square markers name its points."""
        return self.kind in ("charuco", "markers")

    @property
    def markers(self) -> int:
        """How many there are, if any: on a ChArUco board one in every second square."""
        columns, rows = self.shape
        return columns * rows if self.kind == "markers" else (columns + 1) * (rows + 1) // 2

    @property
    def cells(self) -> int:
        """Of a marker, along a side, its dark border's too."""
        return bright_cells(self.dictionary or "", self.markers).shape[-1]

    @property
    def share(self) -> float:
        """Side of the markers over that of a ChArUco board's squares, or over the way from one to the next."""
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
    def laid(self) -> tuple[int, ...]:
        """How its points stand: rows, columns; of each marker two rows and columns more."""
        return (*self.shape[::-1], 2, 2) if self.kind == "markers" else self.shape[::-1]

    @property
    def count(self) -> int:
        """Number n of its points."""
        return math.prod(self.laid)

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
        return self.at(self.places)

    @property
    def places(self) -> np.ndarray:
        """The same on the board, (n, 2)."""
        if self.kind != "markers":
            return numbered(*self.shape)
        return marker_corners(*self.shape, self.share).reshape(-1, 2)

    @property
    def by_pitch(self) -> np.ndarray:
        """Derivative of its points by its pitch, shape (n, 3): the first one stays."""
        return (self.points - np.array(self.corner)) / self.pitch

    @property
    def outer(self) -> np.ndarray:
        """Places of its own corners, counterclockwise, (4, 2): a bright border a pitch wide beyond what is dark, about
        markers half of one."""
        wide, beyond = {"dots": (1.0, 0.0), "markers": (0.5, self.share - 0.5)}.get(self.kind, (2.0, 1.0))
        x, y = np.array(self.shape) + beyond
        return np.array([(-wide, -wide), (x, -wide), (x, y), (-wide, y)])

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
        return dark_outlines(self)

    @property
    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Triangles (T, 3, 3) of what is bright and of what is dark, which cover it once; dots as polygons of the same
        area."""
        bright, dark = (self.at(part) for part in triangles(self))
        return bright, dark
