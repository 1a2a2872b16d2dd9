"""Distances and angles between measured features, with their variances."""

from __future__ import annotations

import numpy as np

from measure.features.shape import Shape
from scenes import InvalidInput
from scenes.arrays import numbers

_FARTHEST = 1e9  # px


def point_distance(
    first: np.ndarray, first_covariance: np.ndarray, second: np.ndarray, second_covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Distance of two independently measured points: corners, centres of circles or of ellipses.

    Parameters
    ----------
    first, second : ndarray, shape (..., 2)
        (x, y), px.
    first_covariance, second_covariance : ndarray, shape (..., 2, 2)
        px^2.

    Returns
    -------
    value, variance : ndarray, shape (...)
        px and px^2 (eq. 6).

    Examples
    --------
    >>> value, variance = point_distance(np.zeros(2), 0.01 * np.eye(2), np.array([3.0, 4.0]), 0.03 * np.eye(2))
    >>> float(value), round(float(variance), 6)
    (5.0, 0.04)
    """
    first, second = _points("first", first), _points("second", second)
    first_covariance = _points("first_covariance", first_covariance, 2)
    second_covariance = _points("second_covariance", second_covariance, 2)
    try:
        np.broadcast_shapes(first.shape, second.shape, first_covariance.shape[:-1], second_covariance.shape[:-1])
    except ValueError:
        raise InvalidInput("points and covariances must be of shapes that go together, got others") from None
    across = second - first
    value = np.linalg.norm(across, axis=-1)
    unit = across / np.where(value > 0, value, 1)[..., None]
    total = first_covariance + second_covariance
    return value, np.einsum("...i,...ij,...j->...", unit, total, unit)


def _points(name: str, values: np.ndarray, axes: int = 1) -> np.ndarray:
    array = numbers(values, name)
    if array.shape[-axes:] != (2,) * axes or not (np.abs(array) <= _FARTHEST**axes).all():
        shape = f"(..., {', '.join('2' * axes)})"
        raise InvalidInput(f"{name} must be of numbers to {_FARTHEST**axes:g}, shape {shape}, got shape {array.shape}")
    return array


def line_angle(shape: Shape, first: int, second: int) -> tuple[np.ndarray, np.ndarray]:
    """Angle between two lines of a shape, 0 to 90 degrees, and its variance, degrees^2, shape (n,).

    Errors of the two lines may be correlated; their joint covariance is used.
    """
    a, b = shape.normals[:, first], shape.normals[:, second]
    sine = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    cosine = np.abs((a * b).sum(1))
    tilt = shape.tilt_covariance
    variance = tilt[:, first, first] + tilt[:, second, second] - 2 * tilt[:, first, second]
    return np.degrees(np.arctan2(sine, cosine)), variance * np.degrees(1.0) ** 2
