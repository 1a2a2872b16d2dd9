"""Bundle adjustment of one camera and the poses of its boards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from measure.boards.chessboard import Board
from measure.boards.elimination import Block, Point, covariance, minimised
from measure.boards.parameters import CameraModel, Model
from measure.boards.view import View, on_board
from scenes.errors import InvalidInput

_LEAST = 0.05  # of the image's longer side: a focal length that no lens has
_HELD = cv2.CALIB_USE_INTRINSIC_GUESS + cv2.CALIB_FIX_FOCAL_LENGTH + cv2.CALIB_FIX_PRINCIPAL_POINT
_SHORTEST = 1e-2  # of the focal length where the search begins: boards that tell none let it go anywhere


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The least whitened residuals.

    ``parameters`` are the free intrinsics and six numbers of each pose, ``covariance`` is theirs; ``sags`` are how far
    the board's middle stands out, along columns and rows, with the covariance ``sag_covariance``; both 0 of a flat
    board. ``rows`` counts residuals, ``told`` the unknowns that they tell (what a prior tells is none),
    ``residuals`` are those of each board's corners in px, (n, 2), NaN where there is none.
    """

    parameters: np.ndarray
    covariance: np.ndarray
    chi_square: float
    rows: int
    told: float
    residuals: tuple[np.ndarray, ...]
    sags: np.ndarray
    sag_covariance: np.ndarray


def begin(boards: Sequence[Board], square: float, image_shape: tuple[int, int], model: Model) -> np.ndarray:
    """Where to begin: OpenCV's calibration, every corner counting the same.

    Boards that tell no focal length may get one below 0, or next to none: then that of a common lens is held.

    Raises
    ------
    InvalidInput
        If it finds none.
    """
    there = [board.measured for board in boards]
    objects = [on_board(board, square)[good].astype(np.float32) for board, good in zip(boards, there, strict=True)]
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


def adjust(
    boards: Sequence[Board],
    square: float,
    model: CameraModel,
    start: np.ndarray,
    curved: bool = False,
    sags: np.ndarray | None = None,
) -> Adjusted:
    """Least squares of all residuals, whitened by the corners' covariance, from ``start``; with ``curved`` the board's
    two sags are unknown, too, else they are those that are given, or 0."""
    known = np.zeros(2) if sags is None else sags
    problem = _Problem([View.of(board, square) for board in boards], model, curved, known)
    k = len(model.names)
    least = _SHORTEST * start[:k][problem.focal]
    with np.errstate(all="ignore"):
        shared, poses = minimised(
            problem.blocks, problem.cost, problem.prior,
            (np.concatenate([start[:k], np.zeros(problem.sags)]), start[k:].reshape(-1, 6)),
            lambda shared: bool((shared[problem.focal] > least).all()),
        )  # fmt: skip
        whole = covariance(problem.blocks((shared, poses)), problem.prior)
    kept = np.r_[:k, k + problem.sags : len(whole)]
    sagged = whole[k : k + problem.sags, k : k + problem.sags]
    by_prior = problem.prior @ whole[: len(shared), : len(shared)] @ problem.prior.T
    left = problem.residuals((shared, poses))
    return Adjusted(
        np.concatenate([shared[:k], poses.ravel()]), whole[np.ix_(kept, kept)], problem.corners_cost((shared, poses)),
        sum(view.corners.size for view in problem.views), len(whole) - float(np.trace(by_prior)),
        tuple(_all(board, found) for board, found in zip(boards, left, strict=True)),
        problem.split(shared)[1], sagged if curved else np.zeros((2, 2)),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Problem:
    """Residuals of all boards, as functions of what they share (intrinsics, sags) and of the poses."""

    views: list[View]
    model: CameraModel
    curved: bool
    bent: np.ndarray

    @property
    def sags(self) -> int:
        return 2 if self.curved else 0

    @property
    def focal(self) -> list[int]:
        return [i for i, name in enumerate(self.model.names) if name in ("fx", "fy")]

    @property
    def prior(self) -> np.ndarray:
        return np.pad(self.model.prior, [(0, 0), (0, self.sags)])

    def split(self, shared: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Intrinsics and both sags."""
        k = len(self.model.names)
        return shared[:k], shared[k:] if self.curved else self.bent

    def blocks(self, point: Point) -> list[Block]:
        shared, poses = point
        values, sags = self.split(shared)
        found = []
        for view, pose in zip(self.views, poses, strict=True):
            by_shared, own = view.jacobian(self.model, values, sags, pose)
            residual = view.residual(self.model, values, sags, pose)
            found.append(Block(residual, by_shared[:, : len(shared)], own))
        return found

    def cost(self, point: Point) -> float:
        known = self.prior @ point[0]
        return self.corners_cost(point) + float(known @ known)

    def corners_cost(self, point: Point) -> float:
        given = self.split(point[0])
        each = (view.residual(self.model, *given, pose) for view, pose in zip(self.views, point[1], strict=True))
        return float(sum(residual @ residual for residual in each))

    def residuals(self, point: Point) -> list[np.ndarray]:
        given = self.split(point[0])
        return [view.left(self.model, *given, pose) for view, pose in zip(self.views, point[1], strict=True)]


def _all(board: Board, left: np.ndarray) -> np.ndarray:
    """Residuals of the whole board, NaN where nothing was measured."""
    found = np.full(board.corners.shape, np.nan)
    found[board.measured] = left
    return found
