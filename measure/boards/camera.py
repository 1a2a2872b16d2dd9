"""A camera calibrated from boards: the likeliest intrinsics, distortion and poses, with their covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from pydantic import ValidationError
from scipy.special import chdtrc

from measure.boards.adjustment import Adjusted, adjust, begin
from measure.boards.chessboard import Board
from measure.boards.eccentricity import centred
from measure.boards.lens_modes import errors_of, lens_modes
from measure.boards.parameters import SPLINED, CameraModel, Model, read_model, splined_control
from measure.boards.splined import SplinedModel, fitted
from measure.photo.lens import Intrinsics, SplinedIntrinsics
from scenes import status
from scenes.cameras.covariance import Covariance
from scenes.cameras.lens_modes import LensMode
from scenes.errors import InvalidInput

FEWEST_BOARDS, FEWEST_CORNERS = 3, 8
_FALSE_ALARM = 0.01
_CENTRINGS = 2  # turns of dots' middles: each leaves about a hundredth of what they are off
_VAGUE = 0.1  # of the focal length: a standard deviation that determines nothing
DEFAULT_MODEL = "k1,k2,p1,p2,k3"


@dataclass(frozen=True, eq=False)
class CameraCalibration:
    """What boards tell of a camera.

    Attributes
    ----------
    model : CameraModel
        What is free, and how it sees.
    names : tuple of str
        The free intrinsics, in OpenCV's order; ``fx`` alone stands for both focal lengths where the model has one.
    values : ndarray, shape (k,)
        Of those, px for fx, fy, cx, cy.
    covariance : ndarray, shape (k, k)
        Of those; enlarged by ``dispersion``.
    lens : Intrinsics or SplinedIntrinsics
        All intrinsics, as `measure.measure_quadrilateral` takes them.
    image_shape : (height, width)
    poses : ndarray, shape (boards, 6)
        Rotation vector (radians) and translation (unit of the squares) from each board to the camera, as OpenCV's.
    pose_covariance : ndarray, shape (boards, 6, 6)
        With the uncertainty of the squares' size, and enlarged by ``dispersion``.
    sags, sag_covariance : ndarray, shape (2,) and (2, 2)
        How far the board's middle stands out of the plane of its outer corners along columns and along rows, unit of
        the squares, positive away from the camera: parabolas; 0 where it is taken for flat. Enlarged by
        ``dispersion``.
    residuals : tuple of ndarray, shape (n, 2) each
        Measured less reprojected corners, px; NaN where there is no corner.
    rms_px : float
        Root mean square length of the residuals.
    chi_square, freedom, p_value : float, int, float
        Squared residuals over the corners' covariance, and how often corners with that covariance leave at least so
        much.
    dispersion : float
        1, or chi-square over its degrees of freedom where the status is ``misfit``: what the covariance was multiplied
        by.
    status : str
        ``ok``, ``misfit`` (corners do not lie where they should within their covariance: another model is needed, or
        the board is not flat), ``ill_conditioned`` (the boards do not determine the focal length to 10 %).
    """

    model: CameraModel
    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    lens: Intrinsics | SplinedIntrinsics
    image_shape: tuple[int, int]
    poses: np.ndarray
    pose_covariance: np.ndarray
    sags: np.ndarray
    sag_covariance: np.ndarray
    residuals: tuple[np.ndarray, ...]
    rms_px: float
    chi_square: float
    freedom: int
    p_value: float
    dispersion: float
    status: str

    @property
    def sd(self) -> np.ndarray:
        """Standard uncertainty of each value, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """Of the values, shape (k, k)."""
        return self.covariance / np.outer(self.sd, self.sd)

    @property
    def is_splined(self) -> bool:
        """Whether displacements are splines, and ``lens`` a `SplinedIntrinsics`."""
        return isinstance(self.model, SplinedModel)

    @property
    def curved(self) -> bool:
        """Whether the board may be bent."""
        return bool(self.sag_covariance.any())

    @property
    def for_budget(self) -> Covariance:
        """The covariance as a scene's ``uncertainty.covariance``.

        Raises
        ------
        InvalidInput
            Of a splined lens, of which `lens_modes` tell.
        """
        if self.is_splined:
            raise InvalidInput(f"model must be one of coefficients for a covariance that scenes take, got {SPLINED}")
        even = (self.covariance + self.covariance.T) / 2
        return Covariance(names=self.names, matrix=tuple(tuple(map(float, row)) for row in even))

    @cached_property
    def errors(self) -> np.ndarray:
        """Independent standard errors of the values, shape (k, m), a column each (`measure.boards.lens_modes`)."""
        return errors_of(self)

    @property
    def lens_modes(self) -> tuple[LensMode, ...]:
        """How well a splined lens is known, as a scene's ``uncertainty.lens_modes`` (`measure.boards.lens_modes`).

        Raises
        ------
        InvalidInput
            Of a lens of coefficients, of which `for_budget` tells.
        """
        return lens_modes(self)


def calibrate_camera(
    boards: Sequence[Board],
    square_size: float,
    image_shape: tuple[int, int],
    model: str = DEFAULT_MODEL,
    square_sd: float = 0.0,
    curved: bool = False,
) -> CameraCalibration:
    """Calibrate a camera from measured chessboards or grids of dots.

    OpenCV's calibration is where it begins; then all corners' residuals, whitened by their covariance, are made least.
    The covariance is the inverse of the normal matrix. Of dots the middles of their images are measured; how far the
    images of their middles are from these is told by the camera and the poses themselves, in turns.

    Parameters
    ----------
    boards : sequence of Board
        Of one camera; at least 3 with at least 8 measured corners each, seen from different directions.
    square_size : float
        Side of the squares, or from one dot to the next, in any unit of length, which is that of the poses. Intrinsics
        do not depend on it.
    image_shape : (height, width)
    model : str
        Free distortion coefficients with commas between, of k1, k2, p1, p2, k3; the others are 0. ``f`` among them:
        one focal length, fx = fy. "none" for a pinhole. Centre and focal lengths are always free. "splined", or
        "splined:12x8" with that many control points, for bicubic splines (`scenes.cameras.Splined`): ``values`` are
        then the focal length and combinations of control points, and the axis is in the image's middle.
    square_sd : float
        Standard uncertainty of ``square_size``, the same for all squares.
    curved : bool
        Whether the board may be bent: how far its middle stands out along columns and along rows is not known, either.

    Raises
    ------
    InvalidInput
        If an argument is bad, or there are too few boards, or they determine no camera.
    """
    control = splined_control(model)
    free: CameraModel = read_model("none" if control else model)
    _check(square_size, square_sd, image_shape)
    if not isinstance(boards, list | tuple) or not all(isinstance(board, Board) for board in boards):
        raise InvalidInput("boards must be a list of Boards, got something else")
    enough = sum(board.measured.sum() >= FEWEST_CORNERS for board in boards)
    if enough < FEWEST_BOARDS or enough < len(boards):
        raise InvalidInput(
            f"boards must be at least {FEWEST_BOARDS}, of at least {FEWEST_CORNERS} measured corners each, "
            f"got {enough} such of {len(boards)}"
        )
    if control:
        free, start = fitted(boards, square_size, image_shape, control)
    else:
        start = begin(boards, square_size, image_shape, read_model(model))
    found = adjust(boards, square_size, free, start, curved)
    if any(board.radius > 0 for board in boards):
        for _ in range(_CENTRINGS):
            middles = centred(boards, square_size, free, found.parameters)
            found = adjust(middles, square_size, free, found.parameters, curved)
    return _calibration(boards, free, image_shape, found, square_sd / square_size)


def _check(square_size: Any, square_sd: Any, image_shape: Any) -> None:
    for name, value, least in (("square_size", square_size, 0.0), ("square_sd", square_sd, -1e-300)):
        number = isinstance(value, int | float | np.number) and not isinstance(value, bool) and np.isfinite(value)
        if not number or not least < value <= 1e9:
            raise InvalidInput(
                f"{name} must be a number {'more than' if not least else 'of at least'} 0, got {value!r}"
            )
    size = image_shape if isinstance(image_shape, tuple | list) else ()
    if len(size) != 2 or not all(isinstance(n, int | np.integer) and 0 < n <= 1 << 15 for n in size):
        raise InvalidInput(f"image_shape must be (height, width) in px, got {image_shape!r}")


def _calibration(boards, free: CameraModel, image_shape, found: Adjusted, scale_sd: float) -> CameraCalibration:
    k = len(free.names)
    freedom = found.rows - round(found.told) if np.isfinite(found.told) else 0
    p_value = float(chdtrc(freedom, found.chi_square)) if freedom > 0 else float("nan")
    dispersion = found.chi_square / freedom if p_value < _FALSE_ALARM else 1.0
    covariance = dispersion * found.covariance[:k, :k]
    poses = found.parameters[k:].reshape(-1, 6)
    blocks = []
    for i, pose in enumerate(poses):
        some = slice(k + 6 * i, k + 6 * i + 6)
        longer = scale_sd * np.concatenate([np.zeros(3), pose[3:]])  # larger squares were further away
        blocks.append(dispersion * found.covariance[some, some] + np.outer(longer, longer))
    values = found.parameters[:k]
    vague = not np.isfinite(covariance).all() or np.sqrt(covariance[0, 0]) > _VAGUE * values[0]
    state = status.ILL_CONDITIONED if vague else status.MISFIT if dispersion != 1.0 else status.OK
    all_residuals = np.concatenate(found.residuals)
    return CameraCalibration(
        model=free, names=free.names, values=values, covariance=covariance,
        lens=_seen_by(free, values),
        image_shape=(int(image_shape[0]), int(image_shape[1])), poses=poses, pose_covariance=np.array(blocks),
        sags=found.sags,
        sag_covariance=dispersion * found.sag_covariance, residuals=found.residuals,
        rms_px=float(np.sqrt(2 * np.nanmean(all_residuals**2))),
        chi_square=found.chi_square, freedom=freedom, p_value=p_value, dispersion=float(dispersion), status=state,
    )  # fmt: skip


def _seen_by(free: CameraModel, values: np.ndarray) -> Intrinsics | SplinedIntrinsics:
    if isinstance(free, SplinedModel):
        return SplinedIntrinsics(fx=values[0], cx=free.middle[0], cy=free.middle[1], spline=free.lens(values))
    assert isinstance(free, Model)
    return _lens(*free.camera(values))


def _lens(matrix: np.ndarray, coefficients: np.ndarray) -> Intrinsics:
    """The lens of a camera matrix (3, 3) and five coefficients, which boards alike may leave anywhere."""
    try:
        return Intrinsics(
            fx=matrix[0, 0], fy=matrix[1, 1], cx=matrix[0, 2], cy=matrix[1, 2], distortion=tuple(coefficients)
        )
    except ValidationError:
        said = ", ".join(f"{value:.3g}" for value in coefficients)
        raise InvalidInput(
            f"boards must be seen from directions that determine the lens, got distortion {said}: turn them more, "
            "bring them near the picture's corners, or free less of it"
        ) from None
