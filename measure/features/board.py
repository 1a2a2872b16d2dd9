"""A board beside the part in images: its points, and what they tell of the place of both."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from scipy import sparse
from scipy.special import chdtrc

from imaging.boards.seen import SeenBoard, leaning, levels, marked_beside
from imaging.boards.windows import steps as ways
from imaging.features.displaced import points_by_deviations
from imaging.geometry.blur import blur_at
from imaging.geometry.lens import lens_jacobian, undistorted
from imaging.geometry.projection import depth, project, project_ideal
from imaging.pictures import Pictures
from imaging.placed import combined, placed
from imaging.sensor import recorded
from measure.boards import chessboard, dots
from measure.boards.chessboard import Board as MeasuredBoard
from measure.boards.chessboard import Squares
from measure.boards.eccentricity import centroid
from measure.boards.marker_grid import Markers
from measure.boards.printed import Printed
from measure.goodness import WORST
from scenes import Board, InvalidInput, Picture, status
from scenes.placement import limits, root

_FEWEST = 6  # points that a board is told by
_STEPS, _FAR = 10, 2.0  # of Gauss and Newton; px that a board's points are left off by at most
_HELD = 0.02  # px: of a placement of one standard uncertainty, about what a point is known to
_OTHER = 0.5  # of the focal length's logarithm, or k1: another camera, which points in a wrong order ask for
_BEYOND = 1.25  # of what is plausible: where noise may take a place that is hardly told
_WIDE = 4  # px that a lens may bend a board's sides by, or more
_AROUND = 96  # places on a dot's outline


@dataclass(frozen=True, eq=False)
class FoundBoard:
    """A board in n images.

    Attributes
    ----------
    offsets : ndarray, shape (n, k)
        Its parameters (`imaging.boards.seen`), beside the expected ones.
    covariance : ndarray, shape (n, k, k)
        By noise.
    state : ndarray of str, shape (n,)
        ``misfit`` where its points do not lie as it is told.
    """

    offsets: np.ndarray
    covariance: np.ndarray
    state: np.ndarray


def find_board(images: np.ndarray, picture: Picture, told: SeenBoard) -> FoundBoard:
    """The board of a scene in images (n, height, width), near where it is expected."""
    tool = BoardTool(picture, told)
    each = [tool.found(image) for image in images]
    offsets, covariance, state = zip(*each, strict=True)
    return FoundBoard(np.array(offsets), np.array(covariance), np.array(state))


def by_board(image: np.ndarray, picture: Picture) -> tuple[np.ndarray | None, float]:
    """The placement (6 + c,) at which a picture's board is seen where an image (height, width) has it, to some tenths
    of a px, and the share of its points that are found; None where there is none within what is plausible.

    The board may be seen from any side: the order of its points is that of the least placement.
    """
    board = picture.scene.placement.board
    try:
        found = _printed(board).measured(image)
    except InvalidInput:
        return None, 0.0
    each = [_nearest(picture, there) for there in _orders(board, found) if there.shape[:-1] == board.laid]
    most = _BEYOND * limits(picture.scene.uncertainty) + 1e-9
    good = [(left, place) for left, place in each if left < _FAR and (np.abs(place[:6]) <= most).all()]
    return (min(good, key=lambda one: one[0])[1] if good else None), float(found.measured.mean())


def _orders(board: Board, found: MeasuredBoard) -> list[np.ndarray]:
    """A board's points as they are found, in the orders that they may have on it, (..., 2): markers, which are numbered
    from the upper left, leave one."""
    grid = found.corners.reshape(*found.shape[::-1], *board.laid[2:], 2)
    if board.has_markers:
        return [grid[::-1, :, ::-1] if board.kind == "markers" else grid[::-1]]
    return [np.rot90(each, k) for each in (grid, grid[::-1]) for k in range(4)]


def _printed(board: Board) -> Printed:
    """What is printed on a scene's board."""
    if not board.has_markers:
        return Printed(board.kind, board.shape)
    return Printed(board.kind, board.shape, board.dictionary or "", board.share)


def _nearest(picture: Picture, grid: np.ndarray) -> tuple[float, np.ndarray]:
    """Gauss-Newton from where the scene says: what is left between points and recorded places (..., 2), root
    mean square ideal px, and the placement."""
    free, left = root(picture.scene), np.inf
    here, held = np.zeros(len(free)), _HELD * np.eye(free.shape[1])
    for _ in range(_STEPS):
        there = placed(picture, here)
        points, sensor = there.scene.placement.board.points, np.array(list(there.sensor))
        wanted = undistorted(grid.reshape(-1, 2), there.scene.camera)
        off = wanted - project_ideal(points, sensor, there.scene.camera)
        good = np.isfinite(off).all(1)
        if good.sum() < _FEWEST or np.abs(here[6:]).max(initial=0.0) > _OTHER:
            return np.inf, here
        left = float(np.sqrt((off[good] ** 2).sum(1).mean()))
        rows = (points_by_deviations(points, sensor, there.scene) @ free)[good].reshape(-1, len(held))
        wanted = np.append(off[good], held @ np.linalg.pinv(free) @ there.scene.placement.mean)
        here = combined(here, free @ np.linalg.lstsq(np.concatenate([rows, held]), wanted, rcond=None)[0])
    return left, here


def board_pixels(picture: Picture) -> np.ndarray:
    """Pixels that a picture's board is found from, bool (height, width): about all its points."""
    board, camera = picture.scene.placement.board, picture.scene.camera
    found = np.zeros((camera.height, camera.width), np.uint8)
    if board is not None:
        columns, rows = board.shape
        around = np.array([(-1, -1), (columns, -1), (columns, rows), (-1, rows)])
        corners = project(board.at(around), np.array(list(picture.sensor)), camera)
        if np.isfinite(corners).all():
            cv2.fillConvexPoly(found, np.rint(corners).astype(np.int32), 1)
            found = cv2.dilate(found, np.ones((2 * _WIDE + 1,) * 2, np.uint8))
    return found.astype(bool)


@dataclass(frozen=True, eq=False)
class BoardTool:
    """Finds the board of one picture's scene."""

    picture: Picture
    told: SeenBoard

    @property
    def board(self) -> Board:
        """As the scene says it."""
        return self.picture.scene.placement.board

    @cached_property
    def _sensor(self) -> np.ndarray:
        return np.array(list(self.picture.sensor))

    @cached_property
    def grid(self) -> np.ndarray:
        """Where its points are expected to be recorded, px, (rows, columns, ..., 2)."""
        found = project(self.board.points, self._sensor, self.picture.scene.camera)
        return found.reshape(*self.board.laid, 2)

    @cached_property
    def _ideal(self) -> np.ndarray:
        return project_ideal(self.board.points, self._sensor, self.picture.scene.camera)

    @cached_property
    def _back(self) -> np.ndarray:
        """Derivative of ideal by recorded coordinates at its points, (n, 2, 2)."""
        return np.linalg.inv(lens_jacobian(self._ideal, self.picture.scene.camera))

    @cached_property
    def _noise(self) -> float:
        """Standard deviation of a pixel's noise: the mean variance of bright and dark, grey levels."""
        noise, pictures = self.picture.scene.noise, Pictures.of(self.picture)
        both = np.concatenate(levels(pictures, self.board, self.board.points))
        return float(np.sqrt(recorded(noise, noise.dark_level + both).noise_variance.mean()))

    def measured(self, image: np.ndarray) -> MeasuredBoard:
        """Its points in an image."""
        return self._kind.measured(image, self._begun, self._noise, *self._layout)

    @property
    def _kind(self) -> Any:
        """What measures its points."""
        return dots if self.board.kind == "dots" else chessboard

    @property
    def _begun(self) -> np.ndarray:
        """From where they are measured."""
        return self._ellipses if self.board.kind == "dots" else self.grid

    @cached_property
    def _layout(self) -> tuple[Any, ...]:
        """How corners lie beside one another, and how their edges bend in the scene's lens; nothing of dots."""
        board = self.board
        if board.kind == "dots":
            return ()
        tags = board.kind == "markers"
        layout = Markers(board.share, board.cells, *board.shape) if tags else Squares(marked_beside(board))
        return layout, layout.bends(self.grid)

    def points(self, found: MeasuredBoard) -> tuple[np.ndarray, np.ndarray]:
        """How far off its points are, ideal px (n, 2), and their covariance (n, 2, 2), infinite of those not found."""
        places = found.corners - (self._eccentric + self._leant if self.board.kind == "dots" else 0.0)
        off = undistorted(places, self.picture.scene.camera) - self._ideal
        spread = self._back @ found.covariance @ np.swapaxes(self._back, -1, -2)
        good = found.measured & np.isfinite(off).all(1) & np.isfinite(spread).all((1, 2))
        lost = np.where(np.eye(2, dtype=bool), np.inf, 0.0)
        return np.where(good[:, None], off, 0.0), np.where(good[:, None, None], spread, lost)

    def found(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
        """Its parameters (k,), their covariance (k, k), and a status."""
        off, noise = self.points(self.measured(image))
        gain, seen = self.told.gain(noise), np.isfinite([noise[:, 0, 0], self.told.noise[:, 0, 0]])
        if seen.sum(1).min() < _FEWEST:  # in the image, or as expected: then the parameters are none
            nothing = np.zeros(len(gain))
            return nothing, np.diag(nothing + np.inf), status.NOT_VISIBLE
        state = status.OK if self._fits(off, noise) >= WORST else status.MISFIT
        return np.einsum("kni,ni->k", gain, off), self.told.spread(noise, gain), state

    def response(self, image: np.ndarray) -> sparse.csr_array:
        """Derivatives of its parameters by the pixels of a noise-free image, (k, height * width)."""
        found = self.measured(image)
        gain = np.einsum("kni,nij->knj", self.told.gain(self.points(found)[1]), self._back)
        return sparse.csr_array(gain.reshape(len(gain), -1)) @ self._kind.respond(
            image, found, self._begun, *self._layout
        )

    def _fits(self, off: np.ndarray, noise: np.ndarray) -> float:
        """How often points would be left so far off their places on the board, by noise, print and pitch."""
        good = np.isfinite(noise[:, 0, 0])
        white = np.linalg.inv(np.linalg.cholesky((noise + self.told.printed)[good]))
        rows = np.concatenate([self.told.slopes, self.told.beside], -1)[good]
        rows, y = (white @ each for each in (rows, off[good, :, None]))
        rows, y = rows.reshape(-1, rows.shape[-1]), y.ravel()
        free = self.told.slopes.shape[-1]
        known = np.diag(np.repeat([0.0, 1.0], [free, rows.shape[1] - free]))
        told = rows.T @ y
        squares = y @ y - told @ np.linalg.pinv(rows.T @ rows + known, hermitian=True) @ told
        return float(chdtrc(max(y.size - free, 1), max(squares, 0.0)))

    @cached_property
    def _outlines(self) -> np.ndarray:
        """Images of the dots' outlines beside those of their middles, recorded px, (n, around, 2)."""
        angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
        circle = self.board.radius * np.stack([np.cos(angle), np.sin(angle)], -1) @ self.board.axes[:2]
        around = (self.board.points[:, None] + circle).reshape(-1, 3)
        there = project(around, self._sensor, self.picture.scene.camera).reshape(-1, _AROUND, 2)
        return there - self.grid.reshape(-1, 1, 2)

    @cached_property
    def _eccentric(self) -> np.ndarray:
        """Middle of each dot's image less the image of its middle, px, (n, 2)."""
        return centroid(self._outlines)

    @cached_property
    def _leant(self) -> np.ndarray:
        """What the light's slope moves the dots' centres by, px, (n, 2): as it does the one in the middle."""
        (columns, rows), pictures = self.board.shape, Pictures.of(self.picture)
        y, x = rows // 2, columns // 2
        bright = levels(pictures, self.board, self.board.points)[0].reshape(rows, columns)
        grid, light = (each[y - 1 : y + 2, x - 1 : x + 2] for each in (self.grid, bright))
        if not light.all():
            return np.zeros((self.board.count, 2))
        blur = float(np.broadcast_to(blur_at(self.picture.scene.camera, self._depth[y * columns + x], grid[1, 1]), ()))
        slope = np.linalg.solve(ways(grid)[1, 1], ways(light[..., None])[1, 1, :, 0]) / light[1, 1]
        moved = leaning(grid, blur, self.board.radius / self.board.pitch)[1] @ slope
        return np.broadcast_to(moved, (self.board.count, 2))

    @cached_property
    def _depth(self) -> np.ndarray:
        return depth(self.board.points, self._sensor, self.picture.scene.camera)

    @cached_property
    def _ellipses(self) -> np.ndarray:
        """x, y, a, b, angle (degrees) of the dots' images, (rows, columns, 5)."""
        angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
        waves = np.stack([np.cos(angle), np.sin(angle)], -1) * 2 / _AROUND
        axes, size, _ = np.linalg.svd(np.einsum("nai,aj->nij", self._outlines, waves))
        turn = np.degrees(np.arctan2(axes[:, 1, 0], axes[:, 0, 0]))
        middle = self.grid.reshape(-1, 2) + self._eccentric
        return np.concatenate([middle, size, turn[:, None]], 1).reshape(*self.grid.shape[:2], 5)
