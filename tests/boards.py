"""Chessboards through a distorting lens, made by brute force: many samples a pixel, nothing shared with `measure`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.interpolate import RectBivariateSpline

from measure.boards.chessboard import Board

COARSE = 4  # px between places at which distortion is undone exactly; a cubic spline is good to 1e-7 squares between


@dataclass(frozen=True)
class Rig:
    """A camera, and the board that it sees: columns x rows inner corners."""

    matrix: np.ndarray
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    size: tuple[int, int] = (640, 480)
    board: tuple[int, int] = (9, 6)
    square: float = 25.0
    blur: float = 0.7
    levels: tuple[float, float] = (40.0, 180.0)

    @property
    def values(self) -> np.ndarray:
        """fx, fy, cx, cy and five coefficients."""
        return np.array([*self.matrix[[0, 1, 0, 1], [0, 1, 2, 2]], *self.distortion])

    def corners(self, pose: np.ndarray) -> np.ndarray:
        """True images of the inner corners, (n, 2) px, for a pose of six numbers."""
        columns, rows = self.board
        return self.seen(pose, np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2))

    def marker_corners(self, pose: np.ndarray, share: float) -> np.ndarray:
        """True images of the corners of columns x rows markers, four of each, row by row, (n, 2) px."""
        columns, rows = self.board
        first = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 1, 2)
        return self.seen(pose, (first + share * np.array([(0, 0), (1, 0), (0, 1), (1, 1)])).reshape(-1, 2))

    def seen(self, pose: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Images of places on the board, in squares, (n, 2) px."""
        places = np.column_stack([places * self.square, np.zeros(len(places))])
        image = cv2.projectPoints(places, pose[:3], pose[3:], self.matrix, np.array(self.distortion))[0]
        return image.reshape(-1, 2)

    def image(self, pose: np.ndarray, samples: int = 5) -> np.ndarray:
        """Noise-free grey levels: samples x samples a pixel, each an average of its own, blurred and averaged."""
        gx, gy = self._on_board(pose, samples)
        columns, rows = self.board
        dark = self._squares(gx, gy, (1 - _wave(gx, columns) * _wave(gy, rows)) / 2)
        return self._recorded(dark, samples)

    def charuco(self, pose: np.ndarray, name: str, share: float, samples: int = 5, older: bool = False) -> np.ndarray:
        """The same, with markers of a dictionary in the bright squares, their sides such a share of the squares'; the
        first square is dark, or bright as before OpenCV 4.6."""
        gx, gy = self._on_board(pose, samples)
        columns, rows = self.board
        sign = _wave(gx, columns) * _wave(gy, rows) * (1 if older else -1)
        numbers = np.full((rows + 1, columns + 1), -1)
        bright = np.indices(numbers.shape).sum(0) % 2 == (0 if older else 1)
        numbers[bright] = np.arange(bright.sum())
        printed = _markers(gx + 1, gy + 1, numbers, name, share)
        return self._recorded(np.maximum(self._squares(gx, gy, (1 - sign) / 2), printed), samples)

    def markers(self, pose: np.ndarray, name: str, share: float, samples: int = 5) -> np.ndarray:
        """The same of columns x rows markers, whose sides are such a share of the way from one to the next; the first
        one's first corner lies at 0, 0."""
        gx, gy = self._on_board(pose, samples)
        columns, rows = self.board
        gap = (1 - share) / 2
        numbers = np.arange(rows * columns).reshape(rows, columns)
        return self._recorded(_markers(gx + gap, gy + gap, numbers, name, share), samples)

    def _squares(self, gx: np.ndarray, gy: np.ndarray, dark: np.ndarray) -> np.ndarray:
        """What is dark within the board, and nothing beside it."""
        columns, rows = self.board
        return dark * _step(gx + 1) * _step(columns - gx) * _step(gy + 1) * _step(rows - gy)

    def _recorded(self, dark: np.ndarray, samples: int) -> np.ndarray:
        """Grey levels of samples of which such a part is dark."""
        low, high = self.levels
        fine = (high - (high - low) * dark).astype(np.float32)
        left = np.sqrt((self.blur * samples) ** 2 - 1 / 12)  # a sample's own width taken off
        fine = cv2.GaussianBlur(fine, (0, 0), left, borderType=cv2.BORDER_REPLICATE)
        width, height = self.size
        return fine.reshape(height, samples, width, samples).mean((1, 3), dtype=float)

    def dots(self, pose: np.ndarray, radius: float, samples: int = 5) -> np.ndarray:
        """The same of columns x rows dark dots, whose radius is so much of the way from one to the next."""
        gx, gy = self._on_board(pose, samples)
        columns, rows = self.board
        x, y = np.clip(np.rint(gx), 0, columns - 1), np.clip(np.rint(gy), 0, rows - 1)
        return self._recorded(_step(radius - np.hypot(gx - x, gy - y)), samples)

    def _on_board(self, pose: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray]:
        """Place on the board, in squares, of every sample."""
        x, y = (np.arange(-COARSE, n + 2 * COARSE, COARSE, dtype=float) for n in self.size)
        pixels = np.stack(np.meshgrid(x, y), -1)
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-13)
        rays = cv2.undistortPoints(
            pixels.reshape(-1, 1, 2), self.matrix, np.array(self.distortion), None, None, None, criteria
        )
        rays = np.concatenate([rays.reshape(pixels.shape), np.ones((*pixels.shape[:2], 1))], -1)
        turn = cv2.Rodrigues(np.asarray(pose[:3], float))[0]
        onto = np.linalg.inv(np.column_stack([turn[:, 0], turn[:, 1], pose[3:]]))
        found = rays @ onto.T
        fine = [(np.arange(n * samples) + 0.5) / samples - 0.5 for n in self.size]
        return tuple(
            RectBivariateSpline(y, x, found[..., k] / found[..., 2] / self.square)(fine[1], fine[0]) for k in (0, 1)
        )


def _wave(place: np.ndarray, lines: int) -> np.ndarray:
    """-1 and +1 in turn, changing at the whole numbers from 0 to lines - 1, averaged over a sample."""
    line = np.clip(np.rint(place), 0, lines - 1)
    slope = np.hypot(*np.gradient(place))
    return np.where(line % 2 == 0, 1.0, -1.0) * np.clip(2 * (place - line) / slope, -1, 1)


def _step(place: np.ndarray) -> np.ndarray:
    """1 above 0, averaged over a sample."""
    return np.clip(place / np.hypot(*np.gradient(place)) + 0.5, 0, 1)


def _markers(x: np.ndarray, y: np.ndarray, numbers: np.ndarray, name: str, share: float) -> np.ndarray:
    """How dark the markers in the middles of squares are, averaged over a sample at their outlines; ``numbers`` (rows,
    columns) of those in the squares from 0, 0 on, -1 where there is none."""
    rows, columns = numbers.shape
    column, row = (np.clip(np.floor(at).astype(int), 0, n - 1) for at, n in ((x, columns), (y, rows)))
    u, v = (x - column - (1 - share) / 2) / share, (y - row - (1 - share) / 2) / share
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    cells = dictionary.markerSize + 2
    bits = np.array([cv2.aruco.generateImageMarker(dictionary, int(n), cells) for n in range(numbers.max() + 1)]) > 0
    at = (np.clip((each * cells).astype(int), 0, cells - 1) for each in (v, u))
    number = numbers[row, column]
    box = _within(u, np.hypot(*np.gradient(x)) / share) * _within(v, np.hypot(*np.gradient(y)) / share)
    return box * (number >= 0) * ~bits[(number, *at)]


def _within(place: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """1 from 0 to 1, averaged over a sample."""
    return np.clip(np.minimum(place, 1 - place) / slope + 0.5, 0, 1)


def poses(rig: Rig, count: int, rng: np.random.Generator, distance: float) -> list[np.ndarray]:
    """Random poses of boards whole in the image."""
    found = []
    columns, rows = rig.board
    middle = np.array([columns - 1, rows - 1, 0]) * rig.square / 2
    while len(found) < count:
        tilt = rng.uniform(0.25, 0.6) * np.array([np.cos(a := rng.uniform(0, 2 * np.pi)), np.sin(a), 0])
        turn = cv2.Rodrigues(cv2.Rodrigues(tilt)[0] @ cv2.Rodrigues(np.array([0, 0, rng.uniform(-0.3, 0.3)]))[0])[0]
        at = np.array([*rng.uniform(-0.12, 0.12, 2), 1.0]) * distance * rng.uniform(0.9, 1.2)
        pose = np.concatenate([turn.ravel(), at - cv2.Rodrigues(turn)[0] @ middle])
        outer = replace(rig, board=(columns + 2, rows + 2))
        shifted = pose.copy()
        shifted[3:] -= cv2.Rodrigues(turn)[0] @ (np.array([1.0, 1.0, 0]) * rig.square)
        corners = outer.corners(shifted)
        if (corners > 4).all() and (corners < np.array(rig.size) - 5).all():
            found.append(pose)
    return found


def in_order(board: Board, truth: np.ndarray) -> np.ndarray:
    """True corners in the order of the measured ones: the nearest."""
    return truth[np.argmin(((board.corners[:, None] - truth) ** 2).sum(-1), 1)]


def told(corners: np.ndarray, covariance: np.ndarray, shape: tuple[int, int]) -> Board:
    """A board with such corners, all of them well measured."""
    n = len(corners)
    return Board(shape, corners, covariance, ("ok",) * n, np.full(n, 0.5), 1.0, 0.7)


SMALL = Rig(np.array([[420.0, 0, 161.0], [0, 421.0, 118.5], [0, 0, 1]]), (-0.15, 0.03, 0.001, -0.0005, 0.0), (320, 240))
