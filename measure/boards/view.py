"""Where a camera sees a board's corners, and how far from there they were measured."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from measure.boards.chessboard import Board
from measure.boards.parameters import CameraModel


@dataclass(frozen=True, eq=False)
class View:
    """One board's measured corners: places on it (m, 3), images (m, 2), the whitening (m, 2, 2) of each, and how far
    (m, 2) it stands out of its plane there for each unit of its two sags."""

    places: np.ndarray
    corners: np.ndarray
    whiten: np.ndarray
    bulge: np.ndarray

    @classmethod
    def of(cls, board: Board, square: float) -> View:
        """Of the corners that are measured."""
        good = board.measured
        whiten = np.linalg.inv(np.linalg.cholesky(board.covariance[good]))
        return cls(on_board(board, square)[good], board.corners[good], whiten, bulges(board)[good])

    def residual(self, model: CameraModel, values: np.ndarray, sags: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Whitened, shape (2 m,)."""
        image = model.seen(values, self._before(sags, pose))[0]
        return np.einsum("nij,nj->ni", self.whiten, image - self.corners).ravel()

    def jacobian(
        self, model: CameraModel, values: np.ndarray, sags: np.ndarray, pose: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the whitened residuals by the camera's values and the sags (2 m, k + 2), by the pose
        (2 m, 6)."""
        turn, by_turn = cv2.Rodrigues(pose[:3])
        flat = self._bent(sags)
        _, by_values, by_points = model.seen(values, flat @ turn.T + pose[3:])
        turned = np.einsum("krc,nc->nrk", by_turn.reshape(3, 3, 3), flat)
        by_sags = (by_points @ turn[:, 2])[..., None] * self.bulge[:, None]
        rows = self.whiten @ np.concatenate([by_values, by_sags, by_points @ turned, by_points], -1)
        rows = rows.reshape(2 * len(flat), -1)
        return rows[:, :-6], rows[:, -6:]

    def left(self, model: CameraModel, values: np.ndarray, sags: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Measured less projected corners, px, (m, 2)."""
        return self.corners - model.seen(values, self._before(sags, pose))[0]

    def _bent(self, sags: np.ndarray) -> np.ndarray:
        return self.places + np.outer(self.bulge @ sags, [0.0, 0.0, 1.0])

    def _before(self, sags: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Corners before the camera, (m, 3)."""
        return self._bent(sags) @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]


def on_board(board: Board, square: float) -> np.ndarray:
    """Corners on a flat board, shape (n, 3), in the unit of the squares."""
    return np.column_stack([square * board.places, np.zeros(len(board.corners))])


def bulges(board: Board) -> np.ndarray:
    """1 - x^2 and 1 - y^2 at each corner, (n, 2): x and y run from -1 to 1 over the board's columns and rows.

    Examples
    --------
    >>> corners = np.zeros((9, 2))
    >>> flat = Board((3, 3), corners, np.zeros((9, 2, 2)), ("ok",) * 9, np.ones(9), 1.0, 1.0)
    >>> bulges(flat)[:, 0]
    array([0., 1., 0., 0., 1., 0., 0., 1., 0.])
    """
    middle = (board.places.max(0) + board.places.min(0)) / 2
    half = np.maximum(np.ptp(board.places, axis=0) / 2, 1e-300)
    return 1 - ((board.places - middle) / half) ** 2
