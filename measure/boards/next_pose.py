"""Where to hold a board for the next photograph of a calibration, so that something is known best.

A photograph more adds the Fisher information of its corners about the camera, less what its own pose takes of it: with
J and K the whitened derivatives by camera and pose, J^T (1 - K K+) J. What is asked is a linear function of the camera:
with E the independent errors that the calibration leaves, and s what each does to the function, its variance is s^T s
before and s^T (1 + E^T J^T (1 - K K+) J E)^-1 s after.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np

from measure.boards.camera import CameraCalibration
from measure.boards.chessboard import Board
from measure.boards.view import View, on_board
from scenes.errors import InvalidInput

_PLACES = -0.3, 0.0, 0.3  # of the board's middle, parts of the image's sides beside its middle
_NEARER = 0.7, 1.0, 1.4  # over the median distance of the boards that were seen
_TILTS, _TOWARDS, _ROLLS = (15.0, 35.0), range(0, 360, 45), (0.0, 90.0)  # degrees
_MARGIN = 4.0  # px from the image's ends, that outer squares stay


@dataclass(frozen=True, eq=False)
class NextBoard:
    """What N candidate poses would leave of a function's variance.

    Attributes
    ----------
    poses : ndarray, shape (N, 6)
        Rotation vector (radians) and translation (unit of the squares) from the board to the camera, as OpenCV's.
    variances : ndarray, shape (N,)
        Of the function, by the camera, after each.
    """

    poses: np.ndarray
    variances: np.ndarray

    @property
    def best(self) -> int:
        """Number of the candidate that leaves least."""
        return int(self.variances.argmin())

    @property
    def pose(self) -> np.ndarray:
        """The best, (6,)."""
        return self.poses[self.best]


def next_board(found: CameraCalibration, boards: Sequence[Board], square_size: float, slopes: np.ndarray) -> NextBoard:
    """The pose, of a grid of those that the camera sees whole, whose photograph lowers a function's variance most.

    Its corners count as measured as the median of those that were, and the camera as it was found.

    Parameters
    ----------
    found : CameraCalibration
        Of ``boards``.
    slopes : ndarray, shape (m,)
        What each of ``found.errors`` does to the function.

    Raises
    ------
    InvalidInput
        If the boards determine no camera, or no pose shows a whole board.
    """
    if not np.isfinite(found.covariance).all():
        raise InvalidInput("boards must determine a camera before another is proposed, got ones that do not")
    places, poses = on_board(boards[0], square_size), candidates(found, boards[0], square_size)
    if not len(poses):
        raise InvalidInput("board must be seen whole from some pose, got none where it is")
    sizes = [np.linalg.det(board.covariance[board.measured]) ** 0.25 for board in boards]
    sigma = np.sqrt(found.dispersion) * float(np.median(np.concatenate(sizes)))
    errors, none = found.errors, np.eye(len(slopes))
    told = [none + errors.T @ information(found, places, pose, sigma) @ errors for pose in poses]
    return NextBoard(poses, np.array([slopes @ np.linalg.solve(each, slopes) for each in told]))


def information(found: CameraCalibration, places: np.ndarray, pose: np.ndarray, sigma: float) -> np.ndarray:
    """What corners (n, 3) known to ``sigma`` px, of a board at an unknown pose about (6,), tell of the camera,
    (k, k)."""
    flat = np.zeros((len(places), 2))
    view = View(places, flat, np.broadcast_to(np.eye(2) / sigma, (len(places), 2, 2)), flat)
    by_shared, by_pose = view.jacobian(found.model, found.values, np.zeros(2), pose)
    own = np.linalg.qr(by_pose)[0]
    rest = by_shared[:, : len(found.names)]
    rest = rest - own @ (own.T @ rest)
    return rest.T @ rest


def candidates(found: CameraCalibration, board: Board, square_size: float) -> np.ndarray:
    """Poses (N, 6) of boards that are whole in the image, outer squares, or what is bright around markers, too."""
    lens, places = found.lens, on_board(board, square_size)
    height, width = found.image_shape
    middle, half = places.mean(0), np.ptp(places, axis=0) / 2
    reach = square_size * (1 - board.marker)
    outer = middle + (places - middle) * (1 + reach / np.where(half > 0, half, np.inf))
    away, poses = float(np.median([middle_of(pose, board, square_size)[2] for pose in found.poses])), []
    for tilt, towards, roll, nearer, x, y in product(_TILTS, _TOWARDS, _ROLLS, _NEARER, _PLACES, _PLACES):
        axis = np.radians(tilt) * np.array([np.cos(np.radians(towards)), np.sin(np.radians(towards)), 0.0])
        rotation = cv2.Rodrigues(axis)[0] @ cv2.Rodrigues(np.array([0.0, 0.0, np.radians(roll)]))[0]
        there = nearer * away * np.array([x * width / lens.fx, y * height / lens.fy, 1.0])
        pose = np.concatenate([cv2.Rodrigues(rotation)[0].ravel(), there - rotation @ middle])
        points = outer @ rotation.T + pose[3:]
        if found.is_splined and not np.isfinite(found.lens.spline.bent(points[:, :2] / points[:, 2:])).all():
            continue  # where no board was seen nothing is recorded
        image = found.model.seen(found.values, points)[0]
        if (image >= _MARGIN).all() and (image <= np.array([width, height]) - 1 - _MARGIN).all():
            poses.append(pose)
    return np.array(poses).reshape(-1, 6)


def middle_of(pose: np.ndarray, board: Board, square_size: float) -> np.ndarray:
    """Where the middle of a board at a pose (6,) is before the camera, (3,), unit of the squares."""
    return cv2.Rodrigues(pose[:3])[0] @ on_board(board, square_size).mean(0) + pose[3:]
