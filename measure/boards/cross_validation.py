"""Which of two models of a camera sees boards better that it was not calibrated with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from measure.boards.adjustment import adjust
from measure.boards.camera import DEFAULT_MODEL, calibrate_camera
from measure.boards.chessboard import Board
from measure.boards.parameters import SPLINED, CameraModel

_FOLDS = 4
_CHANCE = 0.01
_LEAST = 3  # boards to calibrate with


@dataclass(frozen=True, eq=False)
class Compared:
    """Two models, each calibrated without a part of the boards and then asked of that part.

    Attributes
    ----------
    models : (str, str)
        The plainer one first.
    left : ndarray, shape (boards, 2)
        Squared residuals over the corners' covariance of each board by each model, calibrated without it: intrinsics
        as found, the board's own pose the best there is.
    rms_px : (float, float)
        Root mean square distance of those corners.
    p_value : float
        How often boards for which both models are equally good would prefer the second so much (one-sided signed-rank
        test of the boards' differences; Wilcoxon 1945).
    """

    models: tuple[str, str]
    left: np.ndarray
    rms_px: tuple[float, float]
    p_value: float

    @property
    def proposed(self) -> str:
        """The second if it is better beyond chance (1 %), else the first."""
        return self.models[1] if self.p_value < _CHANCE else self.models[0]


def compare_models(
    boards: Sequence[Board],
    square_size: float,
    image_shape: tuple[int, int],
    models: tuple[str, str] = (DEFAULT_MODEL, SPLINED),
    curved: bool = False,
) -> Compared:
    """Cross-validate two models, as `measure.calibrate_camera` names them.

    Every fourth board is left out in turn. What noise does to more unknowns makes the second model worse here, so that
    it is preferred only for what it explains.

    Parameters
    ----------
    boards, square_size, image_shape, curved
        As of `measure.calibrate_camera`; at least 4 boards.

    Raises
    ------
    InvalidInput
        As by `measure.calibrate_camera`, of what is left of the boards.
    """
    folds = min(_FOLDS, max(len(boards) - _LEAST, 1))
    near = [calibrate_camera(boards, square_size, image_shape, name, curved=curved) for name in models]
    found = np.full((len(boards), 2, 2), np.nan)
    for fold in range(folds):
        rest = [board for i, board in enumerate(boards) if i % folds != fold]
        for which, name in enumerate(models):
            camera = calibrate_camera(rest, square_size, image_shape, name, curved=curved)
            known = Known(camera.model, camera.values)
            for i in range(fold, len(boards), folds):
                found[i, which] = _asked(boards[i], square_size, known, camera.sags, near[which].poses[i])
    left, squares = found[..., 0], found[..., 1]
    corners = sum(int(board.measured.sum()) for board in boards)
    p_value = float(stats.wilcoxon(left[:, 0], left[:, 1], alternative="greater").pvalue)
    rms = np.sqrt(squares.sum(0) / corners)
    return Compared(models, left, (float(rms[0]), float(rms[1])), p_value)


@dataclass(frozen=True, eq=False)
class Known:
    """A camera with no free number."""

    model: CameraModel
    values: np.ndarray
    names: tuple[str, ...] = ()

    @property
    def prior(self) -> np.ndarray:
        """Nothing is left to know."""
        return np.zeros((0, 0))

    def seen(self, values: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `CameraModel` has it."""
        image, _, by_points = self.model.seen(self.values, points)
        return image, np.zeros((len(points), 2, 0)), by_points


def _asked(board: Board, square: float, known: Known, sags: np.ndarray, near: np.ndarray) -> tuple[float, float]:
    """Squared residuals, over the covariance and in px^2, of a board at the best pose near one."""
    found = adjust([board], square, known, near, sags=sags)
    return found.chi_square, float(np.nansum(found.residuals[0] ** 2))
