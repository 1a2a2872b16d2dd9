"""What a photograph shows, found and measured."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from measure.boards.chessboard import measured
from measure.features.arranged import BLAS
from measure.find.candidate import CHESSBOARD, CIRCLE, ELLIPSE, QUADRILATERAL, TAG, Candidate
from measure.find.choose import find_in, nearest
from measure.find.search import check_kinds, find
from measure.photo.board_noise import board_covariance
from measure.photo.ellipses import measure_ellipse
from measure.photo.lens import AnyIntrinsics
from measure.photo.noise import noise_sigma
from measure.photo.quadrilateral import MeasuredValue, Quadrilateral, measure_quadrilateral
from measure.photo.recording import recording
from measure.photo.residuals import Residuals, of_ellipse, of_sides
from measure.photo.tags import plain
from scenes import InvalidInput, status
from scenes.arrays import picture
from scenes.photograph import Photograph

_MOST = 1000
_WORKERS = min(os.cpu_count() or 1, 4)  # threads that measure shapes, each with one for its matrices
_STRAIGHT = (QUADRILATERAL, TAG)


@dataclass(frozen=True, eq=False)
class MeasuredShape:
    """One shape, measured.

    Attributes
    ----------
    kind : str
        As of `Candidate`; a "circle" is an ellipse whose axes are equal within three sigma.
    status : str
        Of `scenes.status`: what is not of its `MEASURED` has no values.
    corners : ndarray, shape (4, 2), or None
        (x, y), px, of a quadrilateral or a tag's black square (in the tag's own order); without distortion if a lens
        was given. Of a chessboard all inner corners (n, 2), row by row, NaN where one is not measured.
    ellipse : ndarray, shape (5,), or None
        x, y, a, b, px, and angle, degrees, as in `Ellipse`.
    covariance : ndarray, (2 n, 2 n) or (5, 5), or None
        Joint covariance of the corners or of the ellipse's parameters.
    quantities : tuple of MeasuredValue
        Sides, diagonals and angles, or centre and axes, each with one sigma.
    residuals : tuple of Residuals
        Of each side, or of the ellipse: how far the edge is from it. None with a lens.
    noise, blur_px : float
        Standard deviations of a grey level and of the lens blur, px, as estimated from the image.
    p_value : float
        Goodness of fit of a quadrilateral, or the least of a chessboard's corners; NaN where it is not known.
    candidate : Candidate, optional
        As it was found; None where its corners were given.
    quadrilateral : Quadrilateral, optional
        All that is told of one, and of a tag's square.
    """

    kind: str
    status: str
    corners: np.ndarray | None
    ellipse: np.ndarray | None
    covariance: np.ndarray | None
    quantities: tuple[MeasuredValue, ...]
    residuals: tuple[Residuals, ...]
    noise: float
    blur_px: float
    p_value: float
    candidate: Candidate | None
    quadrilateral: Quadrilateral | None = None

    @property
    def measured(self) -> bool:
        """Whether it has values."""
        return self.status in status.MEASURED


@dataclass(frozen=True, eq=False)
class Shapes:
    """What was measured, and all that was found, the most prominent first."""

    found: tuple[MeasuredShape, ...]
    candidates: tuple[Candidate, ...]


def photograph(
    image: Any,
    *,
    near: Any = None,
    box: Any = None,
    corners: Any = None,
    kinds: tuple[str, ...] | None = None,
    most: int = 5,
    estimator: str = "arrangement",
    lens: AnyIntrinsics | None = None,
) -> Shapes:
    """Find shapes in a photograph and measure them, some at a time where there are several processors.

    Parameters
    ----------
    image : array_like, shape (height, width), or Photograph
        Grey levels, linear in the light; `scenes.photograph.read` makes them of a file.
    near : array_like, shape (2,), optional
        x, y of a point, px: the smallest shape around it is meant, or else the nearest one.
    box : array_like, shape (4,), optional
        x0, y0, x1, y1, px: only what lies in it as a whole is sought.
    corners : array_like, shape (4, 2), optional
        Corners of a quadrilateral to some 5 px, (x, y), px, in order around it: nothing is sought then.
    kinds : tuple of str, optional
        Kinds of `Candidate`; all when not given.
    most : int
        How many are measured, the most prominent first.
    estimator : str
        Of the quadrilaterals and tags.
    lens : Intrinsics or SplinedIntrinsics, optional
        With it only quadrilaterals and tags are measured, for ellipses are not freed from distortion.

    Raises
    ------
    InvalidInput
        If nothing is found, the image is none, or a parameter is bad.
    """
    photo = image if isinstance(image, Photograph) else Photograph(picture(image))
    if not 1 <= most <= _MOST:
        raise InvalidInput(f"most must be from 1 to {_MOST}, got {most}")
    if corners is not None:
        if near is not None or box is not None or kinds is not None:
            raise InvalidInput("near, box and kinds must be left out where corners are given, got some")
        return Shapes((_straight(photo, corners, None, estimator, lens),), ())
    wanted = check_kinds(kinds) & (set(_STRAIGHT) if lens is not None else check_kinds(None))
    sought = tuple(sorted(wanted))
    candidates = () if not sought else find(photo.levels, sought) if box is None else find_in(photo.levels, sought, box)
    chosen = candidates if near is None else nearest(candidates, photo.levels, near)
    if not chosen:
        told = "a quadrilateral, circle, ellipse, tag or chessboard" if kinds is None else f"a {' or a '.join(kinds)}"
        where = "" if box is None else " in the box"
        raise InvalidInput(f"image must show {told}{where}, got none that stands out")
    with BLAS.limit(limits=1), ThreadPoolExecutor(_WORKERS) as pool:
        found = tuple(pool.map(lambda one: _measured(photo, one, estimator, lens), chosen[:most]))
    return Shapes(found, candidates)


def _measured(photo: Photograph, one: Candidate, estimator: str, lens: AnyIntrinsics | None) -> MeasuredShape:
    if one.kind in (CIRCLE, ELLIPSE):
        return _round(photo, one)
    if one.kind == CHESSBOARD:
        return _board(photo, one)
    return _straight(photo, one.outline, one, estimator, lens)


def _straight(
    photo: Photograph, near: Any, one: Candidate | None, estimator: str, lens: AnyIntrinsics | None
) -> MeasuredShape:
    seen = photo
    if one is not None and one.kind == TAG:
        noise = noise_sigma(photo.levels)
        seen = replace(photo, levels=plain(photo.levels, one.outline, one.family, noise))
    told = measure_quadrilateral(seen, estimator, lens, near)
    good = told.status in status.MEASURED
    return MeasuredShape(
        QUADRILATERAL if one is None else one.kind, told.status, told.corners if good else None, None,
        told.covariance if good else None, told.measurands, _residuals(photo, told, lens) if good else (), told.noise,
        told.blur_px, told.p_value, one, told,
    )  # fmt: skip


def _residuals(photo: Photograph, told: Quadrilateral, lens: AnyIntrinsics | None) -> tuple[Residuals, ...]:
    return of_sides(photo.levels, told.corners) if lens is None else ()


def _round(photo: Photograph, one: Candidate) -> MeasuredShape:
    told = measure_ellipse(photo, one.parameters)
    good = told.status in status.MEASURED
    return MeasuredShape(
        told.kind, told.status, None, told.parameters if good else None, told.covariance if good else None,
        _quantities(told) if good else (), (of_ellipse(photo.levels, told.parameters),) if good else (), told.noise,
        told.blur_px, float("nan"), one,
    )  # fmt: skip


def _quantities(told) -> tuple[MeasuredValue, ...]:
    sigma = np.sqrt(np.diag(told.covariance))
    x, y, a, b, angle = told.parameters
    values = [("centre x", x, sigma[0], "px"), ("centre y", y, sigma[1], "px")]
    if told.kind == CIRCLE:
        values.append(("diameter", 2 * a, 2 * sigma[2], "px"))
    else:
        values += [("axis a", 2 * a, 2 * sigma[2], "px"), ("axis b", 2 * b, 2 * sigma[3], "px")]
        values.append(("angle", angle, sigma[4], "deg"))
    return tuple(MeasuredValue(name, float(value), float(s), unit) for name, value, s, unit in values)


def _board(photo: Photograph, one: Candidate) -> MeasuredShape:
    """All inner corners (n, 2), those that are measured; the worst of their statuses."""
    seen = recording(photo)
    noise = float(np.sqrt(seen.curve.variance(photo.levels.mean())))
    told = measured(photo.levels, one.grid, noise)
    good = told.measured
    if not good.any():
        return MeasuredShape(
            CHESSBOARD, told.status[0], None, None, None, (), (), noise, told.blur_px, float("nan"), one
        )
    covariance, alike = board_covariance(photo.levels, told, one.grid, seen)
    said = status.OK if alike else status.CORRELATED
    state = status.worst(*(each for each in told.status if each in status.MEASURED), seen.status, said)
    return MeasuredShape(
        CHESSBOARD, state, told.corners, None, covariance, (), (), noise, told.blur_px,
        float(np.nanmin(told.p_value)), one,
    )  # fmt: skip
