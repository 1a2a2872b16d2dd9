"""Circles and ellipses through edge points, with the covariance of their parameters."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from measure import status
from measure.estimators.gradient import GradientLocator
from measure.features.calipers import MIN_POSITIONS
from measure.features.optics import Optics
from planner.features.locator import MIN_CONTRAST, edge_blur
from scenes import InvalidInput
from scenes.arrays import finite, grey_levels, numbers

_STEPS = 12
_FARTHEST, _LARGEST = 1e9, 1e5  # px; of a point, and of an ellipse that an image shows
_MIN_FOUND = 0.5
_UNITS = np.array([1, 1, 1, 1, np.degrees(1.0)])  # inside, angles are rad


@dataclass(frozen=True)
class Ellipse:
    """Ellipses in n images, or one with the leading shape ().

    Attributes
    ----------
    parameters : ndarray, shape (..., 5)
        Centre (x, y), semi-axes a and b, px, and the angle of a from the x axis towards y, degrees. For a circle a = b
        and the angle is 0.
    covariance : ndarray, shape (..., 5, 5)
        Of the parameters. For a circle a and b are the same number, and the angle has no error.
    status : ndarray of str, shape (...)
        ``ok``, ``low_contrast``, ``not_visible`` or ``ill_conditioned``; parameters are NaN unless ``ok``.
    """

    parameters: np.ndarray
    covariance: np.ndarray
    status: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """(x, y), px, shape (..., 2)."""
        return self.parameters[..., :2]

    @property
    def centre_covariance(self) -> np.ndarray:
        """Covariance of the centre, px^2, shape (..., 2, 2)."""
        return self.covariance[..., :2, :2]


def fit_ellipse(points: np.ndarray, covariance: np.ndarray | float = 1.0, *, circle: bool = False) -> Ellipse:
    """Ellipse (or circle) of least weighted orthogonal distances.

    Parameters
    ----------
    points : array_like, shape (I, 2)
        At least 5 (3 for a circle), px.
    covariance : float, ndarray (I,) or (I, I)
        Variance of each point's distance from the curve, or the covariance of all, px^2. Off-diagonal terms count in
        the result's covariance; weights are the inverse variances.
    circle : bool
        Fit a circle.

    Raises
    ------
    InvalidInput
        If there are too few points, or one is not finite.

    Examples
    --------
    >>> t = np.linspace(0, 6, 40)
    >>> found = fit_ellipse(np.stack([50 + 20 * np.cos(t), 40 + 10 * np.sin(t)], -1), 0.01)
    >>> found.parameters.round(6).tolist()
    [50.0, 40.0, 20.0, 10.0, 0.0]
    """
    points = numbers(points, "points")
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < (3 if circle else 5):
        raise InvalidInput(f"points must be at least {3 if circle else 5} pairs (x, y), got shape {points.shape}")
    if not np.isfinite(points).all():
        raise InvalidInput("points must be finite, got NaN or infinity")
    if np.abs(points).max() > _FARTHEST:
        raise InvalidInput(f"points must lie within {_FARTHEST:g} px, got some beyond")
    full = _covariance(covariance, len(points))
    with np.errstate(divide="ignore"):
        weights = np.minimum(1 / np.diag(full), 1e300)
    start = _start(points, circle)
    (parameters,), (good,) = _descend(points[None], weights / weights.max(), start[None], circle)
    _, jacobian = _distances(points, parameters)
    response, known = _solve(_free(jacobian, circle), weights / weights.max())
    spread = response @ full @ response.T
    if not (good and known):
        return _nothing((), status.ILL_CONDITIONED)
    return Ellipse(parameters * _UNITS, _whole(spread, circle) * np.outer(_UNITS, _UNITS), np.array(status.OK))


def _covariance(given: np.ndarray | float, count: int) -> np.ndarray:
    """Covariance of all points' distances, px^2, shape (I, I)."""
    full = finite(given, "covariance")
    if full.shape not in ((), (count,), (count, count)):
        raise InvalidInput(f"covariance must be a number or of shape (I,) or (I, I), got shape {full.shape}")
    full = full if full.ndim == 2 else np.diag(np.broadcast_to(full, count))
    if not (np.diag(full) >= 0).all() or np.abs(full).max() > _FARTHEST**2:
        raise InvalidInput(f"covariance must be of variances from 0 to {_FARTHEST**2:g} px^2, got others")
    return full


def find_ellipse(
    images: np.ndarray, expected: np.ndarray, optics: Optics, *, circle: bool = False, spacing: float = 2.0
) -> Ellipse:
    """Find an ellipse in images, from edge points along normals of the expected one.

    Parameters
    ----------
    images : ndarray, shape (..., height, width)
        Grey levels.
    expected : array_like, shape (5,)
        Parameters as in `Ellipse`, within ``optics.window_px`` of the truth.
    optics : Optics
        Blur, noise and scale.
    circle : bool
        Fit a circle.
    spacing : float
        Distance of the edge points in units of the smoothing scale.
    """
    images, expected = grey_levels(images, "images"), finite(expected, "expected")
    if images.shape[-2:] != optics.shape:
        raise InvalidInput(f"images must be of the optics' shape {optics.shape}, got {images.shape}")
    if expected.shape != (5,) or not (expected[2:4] > 0).all() or np.abs(expected).max() > _LARGEST:
        raise InvalidInput(
            f"expected must be x, y, a, b and angle of an ellipse, got shape {expected.shape}: {expected}"
        )
    expected = expected / _UNITS
    stack = images.reshape(-1, *images.shape[-2:])
    angles, places, normals = _positions(expected, optics, spacing)
    if len(angles) < max(MIN_POSITIONS, 5):
        return _nothing(images.shape[:-2], status.NOT_VISIBLE)
    locator = GradientLocator.along_curve(optics, angles, places, normals)
    found = locator.locate(stack)
    seen = (found.valid.mean(1) >= _MIN_FOUND) & (found.contrast > MIN_CONTRAST * np.sqrt(optics.noise_variance))
    # on a curve the zero crossing lies inside the edge by half the curvature times the variance of the smoothed profile
    inward = (optics.scale_px**2 + edge_blur(optics.blur_px) ** 2) / 2 * _curvature(expected, angles)
    points = places + (found.offset + inward)[..., None] * normals
    start = np.broadcast_to(expected, (len(stack), 5))
    parameters, good = _descend(points, found.valid.astype(float), start, circle)
    unit = locator.unit_noise().response
    covariances = []
    for row, valid, contrast in zip(parameters, found.valid, found.contrast, strict=True):
        response, known = _solve(_free(_distances(places, row)[1], circle), valid.astype(float))
        noise = response @ unit / max(contrast, 1e-12)
        covariances.append(
            _whole(optics.noise_variance * noise @ noise.T, circle) if known else np.full((5, 5), np.nan)
        )
    state = np.where(seen, np.where(good, status.OK, status.ILL_CONDITIONED), status.LOW_CONTRAST)
    parameters = np.where((state == status.OK)[:, None], parameters, np.nan)
    lead = images.shape[:-2]
    covariance = np.array(covariances).reshape(*lead, 5, 5) * np.outer(_UNITS, _UNITS)
    return Ellipse(parameters.reshape(*lead, 5) * _UNITS, covariance, state.reshape(lead))


def _positions(expected: np.ndarray, optics: Optics, spacing: float):
    """Parameter angles, places (m, 2) and outward unit normals (m, 2) about evenly spaced, where the image has room."""
    fine = np.linspace(0, 2 * np.pi, 2001)
    a, b = expected[2:4]
    speed = np.hypot(a * np.sin(fine), b * np.cos(fine))
    length = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(fine))])
    count = max(8, int(length[-1] / (spacing * optics.scale_px)))
    t = np.interp(length[-1] * np.arange(count) / count, length, fine)
    places, normals = _curve(expected, t)
    margin = optics.window_px + 4 * optics.scale_px + 1
    inside = ((places >= margin) & (places <= np.array(optics.shape[::-1]) - 1 - margin)).all(1)
    return t[inside], places[inside], normals[inside]


def _curvature(parameters: np.ndarray, t: np.ndarray) -> np.ndarray:
    a, b = parameters[2:4]
    return a * b / np.hypot(a * np.sin(t), b * np.cos(t)) ** 3


def _curve(parameters: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y, a, b, angle = parameters
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, s], [-s, c]])
    normal = np.stack([b * np.cos(t), a * np.sin(t)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.stack([a * np.cos(t), b * np.sin(t)], -1) @ rotation + [x, y], normal @ rotation


def _start(points: np.ndarray, circle: bool) -> np.ndarray:
    """Algebraic fit (Kasa) for a circle, OpenCV's direct ellipse fit otherwise, about the points' mean."""
    mean = points.mean(0)
    x, y = (points - mean).T
    design = np.stack([2 * x, 2 * y, np.ones_like(x)], 1)
    centre_x, centre_y, rest = np.linalg.lstsq(design, x**2 + y**2, rcond=None)[0]
    radius = np.sqrt(max(rest + centre_x**2 + centre_y**2, 1e-12))
    if circle:
        return np.array([mean[0] + centre_x, mean[1] + centre_y, radius, radius, 0.0])
    (u, v), (width, height), degrees = cv2.fitEllipseDirect((points - mean).astype(np.float32))
    if not np.isfinite([u, v, width, height]).all() or min(width, height) <= 0:
        return np.array([mean[0] + centre_x, mean[1] + centre_y, radius, 0.9 * radius, 0.0])
    return np.array([mean[0] + u, mean[1] + v, width / 2, height / 2, np.radians(degrees)])


def _descend(points, weights, start, circle) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Newton on orthogonal distances of points (n, m, 2): parameters (n, 5), and whether each settled."""
    results, settled = [], []
    for k, row in enumerate(start):
        weight = weights if weights.ndim == 1 else weights[k]
        row, step = row.copy(), np.inf
        for _ in range(_STEPS):
            distance, jacobian = _distances(points[k], row)
            response, known = _solve(_free(jacobian, circle), weight)
            if not known:
                break
            change = _spread(-response @ distance, circle)
            row = row + change
            row[2:4] = np.maximum(np.abs(row[2:4]), 1e-9)
            step = np.abs(change[:4]).max()
            if step < 1e-10 * row[2]:
                break
        results.append(_tidy(row))
        settled.append(known and bool(step < 1e-6 * max(row[2], 1)))
    return np.array(results), np.array(settled)


def _distances(points: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distances of points (m, 2) from an ellipse, positive outside, and derivatives by its parameters."""
    x, y, a, b, angle = parameters
    c, s = np.cos(angle), np.sin(angle)
    u, v = _local(points, x, y, c, s)
    t = np.arctan2(a * v, b * u)
    for _ in range(6):  # foot of the perpendicular, by Newton
        value = (a * a - b * b) * np.sin(t) * np.cos(t) - a * u * np.sin(t) + b * v * np.cos(t)
        slope = (a * a - b * b) * np.cos(2 * t) - a * u * np.cos(t) - b * v * np.sin(t)
        t = t - np.clip(value / np.where(np.abs(slope) > 1e-300, slope, -1e-300), -0.5, 0.5)
    nx, ny = b * np.cos(t), a * np.sin(t)
    size = np.hypot(nx, ny)
    nx, ny = nx / size, ny / size
    distance = (u - a * np.cos(t)) * nx + (v - b * np.sin(t)) * ny
    turn = -(-b * np.sin(t) * nx + a * np.cos(t) * ny)
    columns = [-(c * nx - s * ny), -(s * nx + c * ny), -np.cos(t) * nx, -np.sin(t) * ny, turn]
    return distance, np.stack(columns, -1)


def _local(points, x, y, c, s):
    """Coordinates of points along the ellipse's axes."""
    dx, dy = points[:, 0] - x, points[:, 1] - y
    return c * dx + s * dy, -s * dx + c * dy


def _free(jacobian: np.ndarray, circle: bool) -> np.ndarray:
    """Columns that the fit may change: all five, or centre and radius."""
    return np.concatenate([jacobian[:, :2], jacobian[:, 2:4].sum(1, keepdims=True)], 1) if circle else jacobian


def _spread(change: np.ndarray, circle: bool) -> np.ndarray:
    return np.array([change[0], change[1], change[2], change[2], 0.0]) if circle else change


def _whole(covariance: np.ndarray, circle: bool) -> np.ndarray:
    if not circle:
        return covariance
    pick = np.zeros((5, 3))
    pick[[0, 1, 2, 3], [0, 1, 2, 2]] = 1
    return pick @ covariance @ pick.T


def _solve(jacobian: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, bool]:
    """Weighted least-squares response (p, m), and whether the points determine all parameters."""
    root = np.sqrt(weights)[:, None]
    q, r = np.linalg.qr(jacobian * root)
    diagonal = np.abs(np.diag(r))
    if len(jacobian) < jacobian.shape[1] or diagonal.min() <= 1e-9 * diagonal.max():
        return np.zeros(jacobian.shape[::-1]), False
    return np.linalg.solve(r, q.T) * root.T, True


def _tidy(row: np.ndarray) -> np.ndarray:
    """The longer axis first, the angle from -pi/2 to pi/2."""
    x, y, a, b, angle = row
    if b > a:
        a, b, angle = b, a, angle + np.pi / 2
    return np.array([x, y, a, b, (angle + np.pi / 2) % np.pi - np.pi / 2])


def _nothing(lead: tuple[int, ...], state: str) -> Ellipse:
    return Ellipse(np.full((*lead, 5), np.nan), np.full((*lead, 5, 5), np.nan), np.full(lead, state))
