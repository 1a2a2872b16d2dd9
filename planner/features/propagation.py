"""How errors of edge points become errors of lines, corners and distances (the paper's section 3).

A line is alpha x + beta y + gamma = 0 with alpha^2 + beta^2 = 1. Variances are px^2. All functions work on
leading dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LineFit:
    """Weighted least-squares line with what its errors depend on; arrays share one leading shape (...).

    Attributes
    ----------
    normal : ndarray, shape (..., 2)
        (alpha, beta), unit length.
    centroid : ndarray, shape (..., 2)
        Weighted mean of the points, px; it lies on the line.
    spread : ndarray
        Weighted variance of the points' x plus that of their y (sigma_x^2 + sigma_y^2), px^2.
    total_weight : ndarray
        W, the sum of 1 / sigma_i^2, px^-2.
    count : int
        Number of points I.
    """

    normal: np.ndarray
    centroid: np.ndarray
    spread: np.ndarray
    total_weight: np.ndarray
    count: int

    @property
    def gamma(self) -> np.ndarray:
        """Signed distance parameter of the line, px."""
        return -np.einsum("...i,...i->...", self.normal, self.centroid)

    @property
    def tilt_variance(self) -> np.ndarray:
        """T of eq. 4: variance of the line's angle, rad^2."""
        weight = (self.count - 1) / self.count * self.total_weight
        return (self.spread + self.count / self.total_weight) / (weight * self.spread**2)


def fit_line(points: np.ndarray, weights: np.ndarray) -> LineFit:
    """Weighted total-least-squares line (section 3.2).

    The means are normalised by W; the printed W-bar does not reproduce a mean. Moments are taken about the
    centroid, so a line far from the origin loses no digits.

    Parameters
    ----------
    points : ndarray, shape (..., I, 2)
        Edge points, px.
    weights : ndarray, shape (..., I)
        1 / sigma_i^2, px^-2. Points of weight 0 do not count, but I stays the number given.
    """
    count = points.shape[-2]
    total = weights.sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        centroid = np.einsum("...i,...ij->...j", weights, points) / total[..., None]
        away = points - centroid[..., None, :]
        x, y = away[..., 0], away[..., 1]
        xx, yy, xy = ((weights * product).sum(-1) / total for product in (x * x, y * y, x * y))
        angle = np.arctan2(2 * xy, xx - yy) / 2
        unbiased = count / (count - 1)
        spread = unbiased * (xx + yy)
    return LineFit(np.stack([-np.sin(angle), np.cos(angle)], -1), centroid, spread, total, count)


def line_covariance(fit: LineFit) -> np.ndarray:
    """Covariance of (alpha, beta, gamma), eq. 3, shape (..., 3, 3).

    In V(gamma) the last term is 1/W; the printed I/W is off by a factor I (a Monte Carlo test settles it).
    """
    alpha, beta = fit.normal[..., 0], fit.normal[..., 1]
    lever = fit.centroid[..., 0] * beta - fit.centroid[..., 1] * alpha
    direction = np.stack([beta, -alpha, -lever], -1)
    covariance = fit.tilt_variance[..., None, None] * direction[..., :, None] * direction[..., None, :]
    covariance[..., 2, 2] += (fit.tilt_variance + 1) / fit.total_weight
    return covariance


def offset_variance(fit: LineFit, point: np.ndarray) -> np.ndarray:
    """E[(alpha r + beta c + gamma)^2] at a point on the line: variance of the line's position there, px^2.

    Equals the quadratic form of eq. 5 in the covariance of eq. 3, rearranged to (s^2 + 1/W) T + 1/W with s the
    distance from the centroid along the line, where nothing cancels.
    """
    along = np.stack([fit.normal[..., 1], -fit.normal[..., 0]], -1)
    s = np.einsum("...i,...i->...", point - fit.centroid, along)
    with np.errstate(divide="ignore", invalid="ignore"):
        return (s**2 + 1 / fit.total_weight) * fit.tilt_variance + 1 / fit.total_weight


def corner_covariance(normals: np.ndarray, variances: np.ndarray) -> np.ndarray:
    """Covariance of the intersection of two lines (eq. 5).

    Parameters
    ----------
    normals : ndarray, shape (..., 2, 2)
        (alpha, beta) of the two lines in rows.
    variances : ndarray, shape (..., 2)
        Variance of each line's offset at the corner, px^2; the two are independent.

    Returns
    -------
    ndarray, shape (..., 2, 2)
        Covariance of (x, y), px^2; infinite diagonal for parallel lines.
    """
    (a1, b1), (a2, b2) = np.moveaxis(normals[..., 0, :], -1, 0), np.moveaxis(normals[..., 1, :], -1, 0)
    determinant = a1 * b2 - a2 * b1
    with np.errstate(divide="ignore", invalid="ignore"):
        response = np.stack([np.stack([b2, -b1], -1), np.stack([-a2, a1], -1)], -2) / determinant[..., None, None]
        covariance = np.einsum("...ij,...j,...kj->...ik", response, variances, response)
    bad = ~np.isfinite(covariance).all((-1, -2))
    return np.where(bad[..., None, None], np.diag([np.inf, np.inf]), covariance)


def distance_variance(ends: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """Variance of the distance between two points (eq. 6), px^2.

    Parameters
    ----------
    ends : ndarray, shape (..., 2, 2)
        The two points (x, y), px.
    covariances : ndarray, shape (..., 2, 2, 2)
        Their covariances, px^2; the points are independent.
    """
    across = ends[..., 0, :] - ends[..., 1, :]
    length = np.linalg.norm(across, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = across / length[..., None]
        variance = np.einsum("...i,...kij,...j->...", unit, covariances, unit)
    return np.where(np.isfinite(variance), variance, np.inf)
