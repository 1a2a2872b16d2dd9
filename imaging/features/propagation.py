"""How errors of lines become errors of corners (the paper's section 3).

A line is alpha x + beta y + gamma = 0 with alpha^2 + beta^2 = 1. Variances are px^2. All functions work on
leading dimensions.
"""

from __future__ import annotations

import numpy as np


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
