"""Covariance of a chessboard's corners where the noise of neighbouring pixels is not independent."""

from __future__ import annotations

import numpy as np

from measure.boards.chessboard import Board, respond
from measure.photo.recording import Recording

_ALIKE = 0.05  # of a standard deviation, in the root mean square over the corners: what makes no difference


def board_covariance(image: np.ndarray, board: Board, grid: np.ndarray, seen: Recording) -> tuple[np.ndarray, bool]:
    """Joint covariance of all coordinates x, y, x, ..., px^2, (2 n, 2 n), NaN where not measured; whether correlation
    hardly changes it.

    A corner whose window shows a misfit keeps what its covariance was enlarged by.
    """
    n = len(board.corners)
    whole = np.zeros((n, 2, n, 2))
    whole[np.arange(n), :, np.arange(n)] = board.covariance
    whole = whole.reshape(2 * n, 2 * n)
    if seen.correlation.white:
        return whole, True
    rows = respond(image, board, grid)
    sigma = np.sqrt(seen.curve.variance(image))
    grown, alone = seen.correlation.covariance_of_many(rows, sigma), board.noise**2 * (rows.power(2).sum(1))
    with np.errstate(invalid="ignore", divide="ignore"):
        told = np.diag(grown) > 0
        enlarged = np.where(told, np.sqrt(np.diag(whole) / alone), 1.0)
        change = np.sqrt(np.mean(np.diag(grown)[told] / alone[told])) if told.any() else 1.0
    grown *= np.outer(enlarged, enlarged)
    grown[~told], grown[:, ~told] = whole[~told], whole[:, ~told]
    return grown, bool(abs(change - 1) < _ALIKE)
