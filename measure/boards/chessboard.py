"""The corners of a chessboard in an image, each with its covariance, its goodness of fit and a status."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from scipy import sparse
from scipy.special import chdtrc

from imaging.boards.fitting import Crossings, crossing_rows, fit_crossings
from imaging.boards.windows import Marked, Windows, steps, windows
from measure.boards.approximate import approximate_corners
from measure.boards.bend import bends
from measure.boards.noise import check_noise, of_board
from scenes import status
from scenes.arrays import picture
from scenes.board_print import marker_corners, numbered
from scenes.errors import InvalidInput

_FALSE_ALARM = 0.01  # of all corners of a board together
_FAINTEST = 3.0  # times the noise: half the difference of bright and dark
_ORDINARY = 0.8  # px of lens blur to begin with
_ROUGH, _FINE = 0.05, 1e-3  # px: the last step of the first and of later rounds; its error is about the square
_ROUNDS, _SETTLED = 4, 0.1  # px that corners may move in the last one
_NEAR = 0.35  # of the way to the next corner: further off it is another one
_FULL = [2.0**bits - 1 for bits in range(8, 17)]  # ends of sensors' scales
_MOST = 200  # corners along a side


@dataclass(frozen=True, eq=False)
class Board:
    """A chessboard's inner corners, the dots of a grid, or the corners of its markers, in one image.

    Attributes
    ----------
    shape : (columns, rows)
        Of inner corners, dots or markers.
    corners : ndarray, shape (n, 2)
        (x, y), px, (0, 0) the centre of the first pixel; row by row; NaN where not measured.
    covariance : ndarray, shape (n, 2, 2)
        Of each corner, px^2. Different corners are independent: the noise is white, and no pixel serves two of them.
        Where the status is ``misfit`` it is enlarged by the residuals' chi-square over its degrees of freedom.
    status : tuple of str, n
        Of `scenes.status`.
    p_value : ndarray, shape (n,)
        Goodness of fit: how often the noise alone would leave at least so much; NaN where not measured.
    noise : float
        Standard deviation of a pixel's noise, grey levels, given or estimated.
    blur_px : float
        Median standard deviation of the lens blur, px.
    radius : float
        Of a grid of dots (`measure.dot_grid`) the dots' radius over the way from one to the next; 0 of a chessboard.
    marker : float
        Of a grid of markers (`measure.marker_grid`) their side over the way from one to the next; else 0. Each has four
        corners, row by row.
    """

    shape: tuple[int, int]
    corners: np.ndarray
    covariance: np.ndarray
    status: tuple[str, ...]
    p_value: np.ndarray
    noise: float
    blur_px: float
    radius: float = 0.0
    marker: float = 0.0

    @property
    def measured(self) -> np.ndarray:
        """Which corners have a value, shape (n,), bool."""
        return np.array([each in status.MEASURED for each in self.status])

    @property
    def places(self) -> np.ndarray:
        """Column and row of each corner on the board, shape (n, 2): to be multiplied by the squares' size."""
        if not self.marker:
            return numbered(*self.shape)
        return marker_corners(*self.shape, self.marker).reshape(-1, 2)


def chessboard(image: Any, shape: tuple[int, int] | None = None, noise: float | None = None) -> Board:
    """Measure the inner corners of the chessboard in an image.

    OpenCV tells roughly where they are; then each is the likeliest crossing of two blurred edges with levels linear in
    place in all four quadrants, in a window up to half way to the next corners. How a lens bends the edges is told by
    the corners together, in a second round.

    Parameters
    ----------
    image : array_like, shape (height, width)
        Grey levels.
    shape : (columns, rows), optional
        Inner corners; counted when not given.
    noise : float, optional
        Standard deviation of white noise, grey levels; from the image when not given.

    Raises
    ------
    InvalidInput
        If there is no such board in the image, or an argument is bad.
    """
    image = picture(image)
    shape = check_shape(shape)
    check_noise(noise)
    grid = approximate_corners(image, shape)
    if grid is None:
        wanted = f"of {shape[0]} x {shape[1]} inner corners" if shape else "of at least 3 x 3 inner corners"
        raise InvalidInput(f"image must show a whole chessboard {wanted}, got none")
    return measured(image, grid, noise)


def check_shape(shape: Any, of: str = "inner corners", least: int = 3) -> tuple[int, int] | None:
    """Columns and rows of inner corners, or of something else, if given.

    Raises
    ------
    InvalidInput
        If they are no two whole numbers from ``least`` to 200.
    """
    if shape is None:
        return None
    good = isinstance(shape, tuple | list) and len(shape) == 2 and all(isinstance(n, int | np.integer) for n in shape)
    if not good or not all(least <= n <= _MOST for n in shape):
        raise InvalidInput(f"shape must be columns and rows of {of}, {least} to {_MOST} each, got {shape!r}")
    return int(shape[0]), int(shape[1])


class Layout(Protocol):
    """How a board's corners, a grid (..., 2) px, lie beside one another; NaN where one is not seen."""

    @property
    def near(self) -> float:
        """Share of the way to the next corner: further off it is another one."""
        ...

    def steps(self, grid: np.ndarray) -> np.ndarray:
        """Along both edges of each corner, (n, 2, 2), px."""
        ...

    def windows(self, image: np.ndarray, grid: np.ndarray, blur: float) -> Windows:
        """Pixels that tell of each corner, through a lens of about such a blur, px."""
        ...

    def bends(self, grid: np.ndarray) -> np.ndarray:
        """Curvature of both edges of each corner, (n, 2), 1/px."""
        ...


@dataclass(frozen=True)
class Squares:
    """Where four squares meet, maybe beside markers: a grid (rows, columns, 2)."""

    marked: Marked | None = None
    near: float = _NEAR

    def steps(self, grid: np.ndarray) -> np.ndarray:
        """To the next corner along rows and columns."""
        return steps(grid).reshape(-1, 2, 2)

    def windows(self, image: np.ndarray, grid: np.ndarray, blur: float) -> Windows:
        """Half way to the next corners, and not into a marker."""
        return windows(image, grid, self.marked, blur)

    def bends(self, grid: np.ndarray) -> np.ndarray:
        """Of lines of corners."""
        return bends(grid).reshape(-1, 2)


def measured(
    image: np.ndarray,
    grid: np.ndarray,
    noise: float | None,
    layout: Layout = Squares(),
    known: np.ndarray | None = None,
) -> Board:
    """The corners about ``grid``, shape (rows, columns, ..., 2), px, NaN where one is not seen, under white noise of a
    standard deviation, which the image tells where it is None; the corners tell how edges bend, where that is not
    ``known``, (n, 2), 1/px."""
    columns, rows = grid.shape[1::-1]
    toward = layout.steps(grid)
    shape = _started(grid, toward)
    near = layout.near * np.linalg.norm(toward, axis=-1).min(1)
    seen, blur = np.isfinite(near), _ORDINARY
    for turn in range(_ROUNDS):
        found = layout.windows(image, grid, blur)
        room = found.room
        if not room.any():
            return _named(_nothing((columns, rows), of_board(image, noise), len(room)), seen)
        some, bend = found.some(room), (layout.bends(grid) * (turn > 0) if known is None else known)[room]
        fitted = fit_crossings(some, shape[room], bend, _FINE if turn else _ROUGH)
        away = np.linalg.norm(fitted.shape[:, :2] - shape[room, :2], axis=1)
        fitted = replace(fitted, converged=fitted.converged & (away < near[room]))
        before, grid = grid, _moved(grid, room, fitted)
        shape[np.flatnonzero(room)[fitted.converged]] = fitted.shape[fitted.converged]
        blur = float(np.exp(np.median(fitted.shape[:, 4])))
        moved = np.nanmax(np.abs(grid - before))
        if turn and moved < _SETTLED:  # windows and bends are those of the corners as they are
            break
    noise = of_board(image, noise, fitted)
    return _named(_board((columns, rows), room, fitted, noise, _clipped(image, some)), seen)


def respond(
    image: np.ndarray, board: Board, grid: np.ndarray, layout: Layout = Squares(), known: np.ndarray | None = None
) -> sparse.csr_array:
    """Derivatives of all coordinates x, y, x, ... of a board's corners by the image's pixels, (2 n, height * width),
    edges' bends, ``known`` or as the corners tell them, held.

    ``grid``, shape (rows, columns, ..., 2), px, says about where corners are that are not measured; their rows are
    empty.
    """
    n = len(board.corners)
    grid = np.where(np.isfinite(board.corners), board.corners, grid.reshape(n, 2)).reshape(grid.shape)
    found = layout.windows(image, grid, board.blur_px)
    which = np.flatnonzero(found.room & board.measured)
    if not which.size:
        return sparse.csr_array((2 * n, image.size))
    some, bend = found.some(which), (layout.bends(grid) if known is None else known)[which]
    rows = crossing_rows(some, fit_crossings(some, _started(grid, layout.steps(grid))[which], bend, _FINE).shape, bend)
    x, y = np.where(some.there[..., None], some.places, 0).astype(int).transpose(2, 0, 1)
    column = np.broadcast_to((y * image.shape[1] + x)[:, None], rows.shape)
    row = np.broadcast_to((2 * which[:, None] + [0, 1])[..., None], rows.shape)
    return sparse.csr_array((rows.ravel(), (row.ravel(), column.ravel())), (2 * n, image.size))


def _started(grid: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Crossings (n, 5) to begin with: edges towards the next corners (n, 2, 2), an ordinary blur."""
    angles = np.arctan2(toward[..., 1], toward[..., 0])
    return np.column_stack([grid.reshape(-1, 2), angles, np.full(len(toward), np.log(_ORDINARY))])


def _nothing(shape: tuple[int, int], noise: float, count: int | None = None) -> Board:
    """Squares too small, or at the image's margin."""
    nan = np.full((shape[0] * shape[1] if count is None else count, 2, 2), np.nan)
    return Board(shape, nan[:, 0], nan, (status.SHORT,) * len(nan), nan[:, 0, 0], noise, np.nan)


def _named(board: Board, seen: np.ndarray) -> Board:
    """The board, whose corners that are not seen, or without neighbours, are told from those without room."""
    told = zip(board.status, seen, strict=True)
    return replace(board, status=tuple(each if here else status.NOT_VISIBLE for each, here in told))


def _moved(grid: np.ndarray, room: np.ndarray, fitted: Crossings) -> np.ndarray:
    """The grid with corners where they were found."""
    flat = grid.reshape(-1, 2).copy()
    good = np.flatnonzero(room)[fitted.converged]
    flat[good] = fitted.shape[fitted.converged, :2]
    return flat.reshape(grid.shape)


def _clipped(image: np.ndarray, some) -> np.ndarray:
    """Whether a window reaches an end of the sensor's scale: 0 or 2^bits - 1 in many pixels."""
    ends = [level for level in (image.min(), image.max()) if level in (0.0, *_FULL) and (image == level).mean() > 0.001]
    return np.array([any((row[here] == end).mean() > 0.02 for end in ends)
                     for row, here in zip(some.levels, some.there, strict=True)])  # fmt: skip


def _board(shape, room: np.ndarray, fitted: Crossings, noise: float, clipped: np.ndarray) -> Board:
    n = room.size
    corners, covariance, p_value = np.full((n, 2), np.nan), np.full((n, 2, 2), np.nan), np.full(n, np.nan)
    states = np.full(n, status.SHORT, dtype=object)
    fit = chdtrc(fitted.freedom, fitted.square / noise**2)
    limit = 1 - (1 - _FALSE_ALARM) ** (1 / n)
    states[room] = np.select(
        [fitted.contrast < _FAINTEST * noise, ~fitted.converged, fit < limit, clipped],
        [status.LOW_CONTRAST, status.ILL_CONDITIONED, status.MISFIT, status.CLUTTER], status.OK,
    )  # fmt: skip
    good = np.isin(states[room], status.MEASURED)
    which = np.flatnonzero(room)[good]
    corners[which] = fitted.shape[good, :2]
    excess = np.where(fit < limit, fitted.square / noise**2 / fitted.freedom, 1.0)[good, None, None]
    covariance[which] = noise**2 * excess * fitted.unit_covariance[good]
    p_value[which] = fit[good]
    blur = float(np.exp(np.median(fitted.shape[:, 4])))
    return Board(shape, corners, covariance, tuple(map(str, states)), p_value, noise, blur)
