"""Weighted fits of circles and ellipses to edge points, and what their errors are (the paper's section 3).

Only the part of a point's error along the curve's normal moves the fit. With a_i the derivative of the curve's
distance at point i along that normal by the parameters, the covariance is (sum of w_i a_i a_i')^-1 with weights
w_i = 1 / sigma_i^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from scenes import InvalidInput


@dataclass(frozen=True)
class CircleFit:
    """Circle through weighted points.

    Attributes
    ----------
    centre : ndarray, shape (2,)
        (x, y), px.
    radius : float
        px.
    covariance : ndarray, shape (3, 3)
        Of (x, y, radius), px^2.
    """

    centre: np.ndarray
    radius: float
    covariance: np.ndarray


@dataclass(frozen=True)
class EllipseFit:
    """Ellipse through weighted points: centre + shape times the unit circle.

    Attributes
    ----------
    centre : ndarray, shape (2,)
        (x, y), px.
    shape : ndarray, shape (2, 2)
        Symmetric positive matrix; its eigenvalues are the half axes, px.
    covariance : ndarray, shape (5, 5)
        Of (x, y, shape_xx, shape_yy, shape_xy), px^2.
    """

    centre: np.ndarray
    shape: np.ndarray
    covariance: np.ndarray


def fit_circle(points: np.ndarray, weights: np.ndarray) -> CircleFit:
    """Weighted geometric fit of a circle.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Edge points, px.
    weights : ndarray, shape (n,)
        1 / sigma_i^2, px^-2.

    Raises
    ------
    InvalidInput
        If fewer than 3 points have weight, or they lie on a line.

    Examples
    --------
    >>> angle = np.arange(8.0)
    >>> round(fit_circle(np.stack([np.cos(angle), np.sin(angle)], -1), np.ones(8)).radius, 9)
    1.0
    """
    points, weights, mean, size = _checked(points, weights, 3)
    moved = (points - mean) / size
    design = np.column_stack([2 * moved, np.ones(len(moved))]) * np.sqrt(weights)[:, None]
    first = np.linalg.lstsq(design, np.sqrt(weights) * (moved**2).sum(1), rcond=None)[0]
    start = np.append(first[:2], np.sqrt(max(first[2] + first[:2] @ first[:2], 1e-12)))

    def residual(p: np.ndarray) -> np.ndarray:
        return np.sqrt(weights) * (np.linalg.norm(moved - p[:2], axis=1) - p[2])

    found = least_squares(residual, start, xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    normal = (moved - found[:2]) / np.linalg.norm(moved - found[:2], axis=1)[:, None]
    covariance = conic_covariance(np.column_stack([normal, np.ones(len(normal))]), weights)
    return CircleFit(mean + size * found[:2], float(size * found[2]), covariance)


def fit_ellipse(points: np.ndarray, weights: np.ndarray) -> EllipseFit:
    """Weighted fit of an ellipse; a point's distance is the implicit function over its gradient (Sampson).

    Parameters
    ----------
    points : ndarray, shape (n, 2)
    weights : ndarray, shape (n,)
        1 / sigma_i^2, px^-2.

    Raises
    ------
    InvalidInput
        If fewer than 5 points have weight, or they lie on no ellipse.
    """
    points, weights, mean, size = _checked(points, weights, 5)
    moved, root = (points - mean) / size, np.sqrt(weights / weights.max())
    spread = np.linalg.cholesky(2 * moved.T @ moved / len(moved))
    start = np.array([0, 0, *_inverse_parts(np.linalg.inv(spread @ spread.T))])

    def residual(p: np.ndarray) -> np.ndarray:
        value, gradient = _implicit(moved, p)
        return root * value / np.linalg.norm(gradient, axis=1)

    solved = least_squares(residual, start, xtol=1e-14, ftol=1e-14, gtol=1e-14, x_scale="jac")
    values, vectors = np.linalg.eigh(_matrix(solved.x[2:]))
    if values.min() <= 0 or not np.isfinite(values).all():
        raise InvalidInput("points must lie on an ellipse, got points on none")
    shape = vectors @ np.diag(1 / values) @ vectors.T
    return EllipseFit(mean + size * solved.x[:2], size * shape, _ellipse_covariance(moved, solved.x, shape, weights))


def conic_covariance(design: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(sum of w a a')^-1, shape (k, k), from derivatives (n, k) of the distances along the normals."""
    return np.linalg.inv(np.einsum("n,ni,nj->ij", weights, design, design))


def _checked(points, weights, least: int):
    """Points with weight, their weights, centre and size."""
    points, weights = np.asarray(points, float), np.asarray(weights, float)
    used = weights > 0
    if used.sum() < least:
        raise InvalidInput(f"points must be at least {least} with weight, got {int(used.sum())}")
    points, weights = points[used], weights[used]
    mean = points.mean(0)
    spread = np.linalg.svd(points - mean, compute_uv=False)
    if not spread[1] > 1e-9 * spread[0]:
        raise InvalidInput("points must not lie on a line, got points that do")
    return points, weights, mean, float(spread[0] / np.sqrt(len(points)))


def _matrix(parts: np.ndarray) -> np.ndarray:
    xx, yy, xy = parts
    return np.array([[xx, xy], [xy, yy]])


def _inverse_parts(square: np.ndarray) -> tuple[float, float, float]:
    """Parts of the symmetric square root of a positive matrix."""
    values, vectors = np.linalg.eigh(square)
    root = vectors @ np.diag(np.sqrt(values)) @ vectors.T
    return root[0, 0], root[1, 1], root[0, 1]


def _implicit(points: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(|Q (x - c)|^2 - 1) / 2 and its gradient; Q is the inverse of the shape."""
    inverse = _matrix(p[2:])
    unit = (points - p[:2]) @ inverse
    return ((unit**2).sum(1) - 1) / 2, unit @ inverse


def _ellipse_covariance(points: np.ndarray, p: np.ndarray, shape: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Covariance of centre and shape: a point c + S u moves by dc + dS u, of which the normal part counts."""
    _, gradient = _implicit(points, p)
    normal = gradient / np.linalg.norm(gradient, axis=1)[:, None]
    u = (points - p[:2]) @ np.linalg.inv(shape)
    u /= np.linalg.norm(u, axis=1)[:, None]
    cross = normal[:, 0] * u[:, 1] + normal[:, 1] * u[:, 0]
    design = np.column_stack([normal, normal[:, 0] * u[:, 0], normal[:, 1] * u[:, 1], cross])
    return conic_covariance(design, weights)
