"""Bundle adjustment of one camera and the poses of its boards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from measure.boards.chessboard import Board
from measure.boards.parameters import Model
from scenes.errors import InvalidInput

_TRIES = 200
_LEAST = 0.05  # of the image's longer side: a focal length that no lens has
_HELD = cv2.CALIB_USE_INTRINSIC_GUESS + cv2.CALIB_FIX_FOCAL_LENGTH + cv2.CALIB_FIX_PRINCIPAL_POINT
_SHORTEST = 1e-2  # of the focal length where the search begins: boards that tell none let it go anywhere


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The least whitened residuals.

    ``parameters`` are the free intrinsics and six numbers of each pose, ``covariance`` is theirs; ``rows`` counts
    residuals, ``residuals`` are those of each board's corners in px, (n, 2), NaN where there is none.
    """

    parameters: np.ndarray
    covariance: np.ndarray
    chi_square: float
    rows: int
    residuals: tuple[np.ndarray, ...]


def begin(boards: Sequence[Board], square: float, image_shape: tuple[int, int], model: Model) -> np.ndarray:
    """Where to begin: OpenCV's calibration, every corner counting the same.

    Boards that tell no focal length may get one below 0, or next to none: then that of a common lens is held.

    Raises
    ------
    InvalidInput
        If it finds none.
    """
    there = [board.measured for board in boards]
    objects = [_object(board, square)[good].astype(np.float32) for board, good in zip(boards, there, strict=True)]
    corners = [board.corners[good].astype(np.float32) for board, good in zip(boards, there, strict=True)]
    size = image_shape[::-1]
    try:
        told = cv2.calibrateCamera(objects, corners, size, None, None, flags=model.flags)
        if not min(told[1][0, 0], told[1][1, 1]) > _LEAST * max(size):
            common = np.array([[max(size), 0, (size[0] - 1) / 2], [0, max(size), (size[1] - 1) / 2], [0, 0, 1]], float)
            told = cv2.calibrateCamera(objects, corners, size, common, np.zeros(5), flags=model.flags | _HELD)
    except cv2.error:
        raise InvalidInput("boards must determine a camera, got boards from which none can be found") from None
    _, matrix, coefficients, turns, places = told
    poses = [np.concatenate([np.ravel(turn), np.ravel(place)]) for turn, place in zip(turns, places, strict=True)]
    found = np.concatenate([model.values(matrix, coefficients), *poses])
    if not np.isfinite(found).all():
        raise InvalidInput("boards must determine a camera, got boards from which none can be found")
    return found


def adjust(boards: Sequence[Board], square: float, model: Model, start: np.ndarray) -> Adjusted:
    """Least squares of all residuals, whitened by the corners' covariance, from ``start``."""
    views = [View.of(board, square) for board in boards]
    k = len(model.names)

    def residual(parameters: np.ndarray) -> np.ndarray:
        camera = model.camera(parameters[:k])
        poses = parameters[k:].reshape(-1, 6)
        return np.concatenate([view.residual(camera, pose) for view, pose in zip(views, poses, strict=True)])

    def jacobian(parameters: np.ndarray) -> np.ndarray:
        camera, poses, rows = model.camera(parameters[:k]), parameters[k:].reshape(-1, 6), []
        for i, (view, pose) in enumerate(zip(views, poses, strict=True)):
            by_pose, by_camera = view.jacobian(camera, pose)
            row = np.zeros((len(by_pose), parameters.size))
            row[:, :k], row[:, k + 6 * i : k + 6 * i + 6] = model.derivatives(by_camera), by_pose
            rows.append(row)
        return np.concatenate(rows)

    from scipy.optimize import least_squares  # slow to load, and rarely needed

    least = np.full(start.size, -np.inf)
    focal = [i for i, name in enumerate(model.names) if name in ("fx", "fy")]
    least[focal] = _SHORTEST * start[focal]
    with np.errstate(all="ignore"):
        found = least_squares(
            residual, start, jacobian, (least, np.inf), "trf", x_scale="jac",
            xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=_TRIES,
        )  # fmt: skip
    camera, poses = model.camera(found.x[:k]), found.x[k:].reshape(-1, 6)
    left = tuple(view.left(camera, pose, board) for view, pose, board in zip(views, poses, boards, strict=True))
    return Adjusted(found.x, _inverse(found.jac), float(2 * found.cost), found.fun.size, left)


def _inverse(jacobian: np.ndarray) -> np.ndarray:
    """Inverse normal matrix; infinite where the residuals determine nothing."""
    size = np.linalg.norm(jacobian, axis=0)
    if not (size > 0).all():
        return np.full((size.size, size.size), np.inf)
    triangle = np.linalg.qr(jacobian / size, mode="r")
    if np.linalg.cond(triangle) > 1e10:
        return np.full((size.size, size.size), np.inf)
    root = np.linalg.inv(triangle) / size[:, None]
    return root @ root.T


@dataclass(frozen=True, eq=False)
class View:
    """One board's measured corners: places on it, images, and the whitening (m, 2, 2) of each."""

    places: np.ndarray
    corners: np.ndarray
    whiten: np.ndarray

    @classmethod
    def of(cls, board: Board, square: float) -> View:
        good = board.measured
        whiten = np.linalg.inv(np.linalg.cholesky(board.covariance[good]))
        return cls(_object(board, square)[good], board.corners[good], whiten)

    def residual(self, camera, pose: np.ndarray) -> np.ndarray:
        """Whitened, shape (2 m,)."""
        return np.einsum("nij,nj->ni", self.whiten, self._projected(camera, pose)[0] - self.corners).ravel()

    def jacobian(self, camera, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of the whitened residuals by the pose (2 m, 6), and by fx, fy, cx, cy and five coefficients (2 m, 9)."""
        raw = self._projected(camera, pose)[1].reshape(len(self.places), 2, -1)
        whitened = np.einsum("nij,njk->nik", self.whiten, raw).reshape(2 * len(self.places), -1)
        return whitened[:, :6], whitened[:, 6:15]

    def left(self, camera, pose: np.ndarray, board: Board) -> np.ndarray:
        """Measured less projected corners of the whole board, px."""
        found = np.full(board.corners.shape, np.nan)
        found[board.measured] = self.corners - self._projected(camera, pose)[0]
        return found

    def _projected(self, camera, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points, by = cv2.projectPoints(self.places[:, None], pose[:3], pose[3:], camera[0], camera[1])[:2]
        return points.reshape(-1, 2), by


def _object(board: Board, square: float) -> np.ndarray:
    """Corners on the board, shape (n, 3), in the unit of the squares."""
    return np.column_stack([square * board.places, np.zeros(len(board.corners))])
