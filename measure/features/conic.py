"""Circles and ellipses through edge points, with the covariance of their parameters."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from scenes import InvalidInput, status
from scenes.arrays import finite, numbers

_STEPS = 12
UNITS = np.array([1, 1, 1, 1, np.degrees(1.0)])  # inside, angles are rad
_FARTHEST = 1e9  # px; of a point


@dataclass(frozen=True, eq=False)
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
        ``ok``, ``clutter``, ``low_contrast``, ``not_visible`` or ``ill_conditioned``; parameters are NaN unless it is
        one of the first two.
    """

    parameters: np.ndarray
    covariance: np.ndarray
    status: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """(x, y), px, shape (..., 2)."""
        return self.parameters[..., :2]


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
        return no_ellipse((), status.ILL_CONDITIONED)
    return Ellipse(parameters * UNITS, _whole(spread, circle) * np.outer(UNITS, UNITS), np.array(status.OK))


def _covariance(given: np.ndarray | float, count: int) -> np.ndarray:
    """Covariance of all points' distances, px^2, shape (I, I)."""
    full = finite(given, "covariance")
    if full.shape not in ((), (count,), (count, count)):
        raise InvalidInput(f"covariance must be a number or of shape (I,) or (I, I), got shape {full.shape}")
    full = full if full.ndim == 2 else np.diag(np.broadcast_to(full, count))
    if not (np.diag(full) >= 0).all() or np.abs(full).max() > _FARTHEST**2:
        raise InvalidInput(f"covariance must be of variances from 0 to {_FARTHEST**2:g} px^2, got others")
    return full


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
    return c * dx + s * dy, c * dy - s * dx


def along_axes(points: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (m,) of points (m, 2) along the axes of an ellipse x, y, a, b, angle (degrees)."""
    x, y, _, _, angle = parameters
    return _local(points, x, y, np.cos(np.radians(angle)), np.sin(np.radians(angle)))


def nearly_away(points: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Signed distances (m,) of points (m, 2) from an ellipse x, y, a, b, angle (degrees), px, to first order."""
    (u, v), (a, b) = along_axes(points, parameters), parameters[2:4]
    size = np.hypot(u / a, v / b)
    return (size - 1) * size / np.maximum(np.hypot(u / a**2, v / b**2), 1e-12)


def around(parameters: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (count, 2) on an ellipse x, y, a, b, angle (degrees), and outward unit normals there."""
    x, y, a, b, angle = parameters
    t = 2 * np.pi * np.arange(count) / count
    cosine, sine = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn = np.array([[cosine, sine], [-sine, cosine]])
    places = np.stack([a * np.cos(t), b * np.sin(t)], 1) @ turn + [x, y]
    normals = np.stack([b * np.cos(t), a * np.sin(t)], 1) @ turn
    return places, normals / np.linalg.norm(normals, axis=1, keepdims=True)


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


def no_ellipse(lead: tuple[int, ...], state: str) -> Ellipse:
    """Nothing measured in images of leading shape ``lead``."""
    return Ellipse(np.full((*lead, 5), np.nan), np.full((*lead, 5, 5), np.nan), np.full(lead, state))
