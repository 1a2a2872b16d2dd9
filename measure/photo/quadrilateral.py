"""A quadrilateral in a user's own photograph: sides, diagonals and angles, each with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from measure import status
from measure.estimators.registry import SYNONYMS
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape
from measure.find.search import find_quadrilateral
from measure.photo.lens import Lens, straight_corners
from measure.photo.noise import noise_sigma
from measure.photo.profiles import edge_sigma, refined
from scenes import InvalidInput
from scenes.arrays import finite, picture


@dataclass(frozen=True)
class MeasuredValue:
    """A measured number: name, value, standard deviation (1 sigma) and unit ("px" or "deg")."""

    name: str
    value: float
    sigma: float
    unit: str


@dataclass(frozen=True)
class Quadrilateral:
    """What a photograph tells.

    Attributes
    ----------
    corners : ndarray, shape (4, 2)
        (x, y), px, in order around it; without distortion if a lens was given.
    covariance : ndarray, shape (8, 8)
        Joint covariance of all corners, px^2.
    measurands : tuple of MeasuredValue
        Four sides, two diagonals, four angles.
    noise, blur_px : float
        Standard deviation of a grey level and of the lens blur, px, as estimated from the image.
    status : str
    p_value : float
        Goodness of fit of straight sides, smooth faces, Gaussian blur and white noise, whichever estimator measured:
        where it is below 1e-4 the status is ``misfit``. NaN where a lens bends the sides.
    """

    corners: np.ndarray
    covariance: np.ndarray
    measurands: tuple[MeasuredValue, ...]
    noise: float
    blur_px: float
    status: str
    p_value: float


def measure_quadrilateral(
    image: np.ndarray,
    estimator: str = "arrangement",
    lens: Lens | None = None,
    corners: np.ndarray | None = None,
) -> Quadrilateral:
    """Measure a quadrilateral: the one near ``corners``, or else the most prominent one.

    Parameters
    ----------
    image : array_like, shape (height, width)
        Grey levels.
    estimator : {"strip", "arrangement", "isophote", "gradient", "canny"}
        With a lens always ``gradient``, whose edge points are freed from distortion one by one.
    lens : Lens, optional
        Intrinsics and distortion.
    corners : array_like, shape (4, 2), optional
        Where its corners are, (x, y), px, to some 5 px, in order around it.

    Raises
    ------
    InvalidInput
        If there is no quadrilateral, the image is no image, or the corners are no quadrilateral's in it.
    """
    image = picture(image)
    near = find_quadrilateral(image) if corners is None else _expected(corners, image.shape)
    corners, noise = refined(image, near), max(noise_sigma(image), np.sqrt(1 / 12))
    blur = edge_sigma(image, corners)
    optics = Optics(image.shape, blur, noise**2, max(1.0, blur), 3 + 2 * max(1.0, blur))
    likeliest = SYNONYMS.get(estimator, estimator) == "arrangement" and lens is None
    if likeliest:
        shape = find_shape(image[None], polygon_layout(corners, optics), "arrangement")
        if shape.status[0] in status.MEASURED:
            return _reported(shape.corners[0], shape.covariance[0], noise, blur, str(shape.status[0]), shape.p_value[0])
    shape = find_shape(image[None], polygon_layout(corners, optics), "gradient")
    state = str(shape.status[0])
    if state in status.MEASURED and lens is not None:
        found = straight_corners(image, polygon_layout(lens.straighten(shape.corners[0]), optics), lens)
        return _reported(found.corners, found.covariance, noise, blur, state)
    if state not in status.MEASURED:
        return _reported(shape.corners[0], shape.covariance[0], noise, blur, state)
    near = polygon_layout(shape.corners[0], optics)
    whole = find_shape(image[None], near, "arrangement")
    if likeliest:
        shape = whole
    elif estimator != "gradient":
        shape = find_shape(image[None], near, estimator, _threshold(shape))
    fits = status.MISFIT if status.MISFIT in whole.status else status.OK
    return _reported(
        shape.corners[0], shape.covariance[0], noise, blur, status.worst(str(shape.status[0]), fits), whole.p_value[0]
    )


def _expected(corners: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    corners = finite(corners, "corners")
    if corners.shape != (4, 2) or not cv2.isContourConvex(corners.astype(np.float32)):
        raise InvalidInput(f"corners must be the four corners of a convex quadrilateral, got {corners.tolist()}")
    if (corners < 0).any() or (corners > np.array(shape[::-1]) - 1).any():
        raise InvalidInput(f"corners must lie in the image of {shape[1]} x {shape[0]} px, got {corners.tolist()}")
    return corners


def _threshold(shape) -> float:
    """Canny's gradient threshold at a third of the weakest edge's peak."""
    return float(max(shape.edge_contrast[0].min() / 9, 1e-6))


def _reported(corners, covariance, noise: float, blur: float, state: str, p: float = float("nan")) -> Quadrilateral:
    values = _values(corners, covariance) if np.isfinite(corners).all() else ()
    return Quadrilateral(corners, covariance, values, noise, blur, state, float(p))


def _values(corners: np.ndarray, covariance: np.ndarray) -> tuple[MeasuredValue, ...]:
    found = [_length(f"side {i + 1}-{(i + 1) % 4 + 1}", corners, covariance, i, (i + 1) % 4) for i in range(4)]
    found += [_length(f"diagonal {i + 1}-{i + 3}", corners, covariance, i, i + 2) for i in range(2)]
    return tuple(found + [_angle(f"angle {i + 1}", corners, covariance, i) for i in range(4)])


def _length(name: str, corners: np.ndarray, covariance: np.ndarray, i: int, j: int) -> MeasuredValue:
    across = corners[j] - corners[i]
    value = float(np.linalg.norm(across))
    gradient = np.zeros(8)
    gradient[2 * i : 2 * i + 2], gradient[2 * j : 2 * j + 2] = -across / value, across / value
    return MeasuredValue(name, value, float(np.sqrt(gradient @ covariance @ gradient)), "px")


def _angle(name: str, corners: np.ndarray, covariance: np.ndarray, i: int) -> MeasuredValue:
    """Angle at corner i: each arm's direction turns by its cross component over its length."""
    gradient, directions = np.zeros(8), []
    for sign, j in ((1, (i + 1) % 4), (-1, (i - 1) % 4)):
        arm = corners[j] - corners[i]
        turn = sign * np.array([-arm[1], arm[0]]) / (arm @ arm)
        gradient[2 * j : 2 * j + 2] += turn
        gradient[2 * i : 2 * i + 2] -= turn
        directions.append(arm / np.linalg.norm(arm))
    value = np.degrees(np.arccos(np.clip(directions[0] @ directions[1], -1, 1)))
    return MeasuredValue(name, float(value), float(np.degrees(np.sqrt(gradient @ covariance @ gradient))), "deg")
