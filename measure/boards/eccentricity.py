"""How far the middle of a dot's image lies from the image of its middle: perspective makes the nearer half larger."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from measure.boards.chessboard import Board
from measure.boards.parameters import CameraModel

_AROUND = 96  # places on a dot's outline: the polygon's middle is the outline's to 1e-3 of what it is off


def centred(boards: Sequence[Board], square: float, model: CameraModel, parameters: np.ndarray) -> list[Board]:
    """Boards whose measured centres are those of the dots themselves, by a camera and poses that are about known.

    Parameters
    ----------
    boards : sequence of Board
        As they were measured.
    square : float
        From one dot to the next, in the unit of the poses.
    model, parameters
        As of `measure.boards.adjustment`: intrinsics, and six numbers of each pose.
    """
    k = len(model.names)
    poses = parameters[k:].reshape(-1, 6)
    return [
        replace(board, corners=board.corners - offsets(board, square, pose, model, parameters[:k]))
        if board.radius > 0
        else board
        for board, pose in zip(boards, poses, strict=True)
    ]


def offsets(board: Board, square: float, pose: np.ndarray, model: CameraModel, values: np.ndarray) -> np.ndarray:
    """Middle of each dot's image less the image of its middle, px, (n, 2)."""
    angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
    circle = board.radius * np.stack([np.cos(angle), np.sin(angle)], -1)
    around = _projected(square * (board.places[:, None] + circle), pose, model, values)
    middle = _projected(square * board.places, pose, model, values)
    return centroid(around - middle[:, None])


def _projected(places: np.ndarray, pose: np.ndarray, model: CameraModel, values: np.ndarray) -> np.ndarray:
    flat = np.concatenate([places.reshape(-1, 2), np.zeros((places[..., 0].size, 1))], 1)
    return model.seen(values, flat @ cv2.Rodrigues(pose[:3])[0].T + pose[3:])[0].reshape(places.shape)


def centroid(outline: np.ndarray) -> np.ndarray:
    """Of the area within polygons (n, m, 2), (n, 2).

    Examples
    --------
    >>> centroid(np.array([[[0.0, 0], [2, 0], [2, 1], [0, 1]]]))
    array([[1. , 0.5]])
    """
    ahead = np.roll(outline, -1, 1)
    cross = outline[..., 0] * ahead[..., 1] - outline[..., 1] * ahead[..., 0]
    return ((outline + ahead) * cross[..., None]).sum(1) / (3 * cross.sum(1)[:, None])
