"""Noise that all pixels of a row, or of a column, have in common: what it is in pixels, and what it does to edges.

A read-out circuit adds the same to a whole row, anew in each picture. Along a row that moves no edge. Across rows it is
as any other noise, but all of an edge that lies along them is moved together: nothing averages out.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from imaging.features.sampling import crossing_gain
from scenes import Noise

_ENDS, _NODES = 5.0, 64  # of the spectrum w^4 exp(-s^2 w^2), in 1 / s; places of the sum over it
_SHORT = 0.02  # smoothing scales: over less of y a point's error does not change


def shared(noise: Noise, pixels: np.ndarray, width: int) -> tuple[sparse.csr_array, np.ndarray]:
    """Which pixels have which shared error in them, (P, L), and the variances (L,) of these, grey levels^2.

    Parameters
    ----------
    noise : Noise
    pixels : ndarray of int, shape (P,)
        Flat indices in an image ``width`` px wide.

    Examples
    --------
    >>> parts, variance = shared(Noise(sigma=1.0, row_sigma=0.5), np.array([0, 1, 4]), 4)
    >>> parts.toarray().tolist(), variance.tolist()
    ([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [0.25, 0.25])
    """
    parts, variances = [sparse.csr_array((len(pixels), 0))], [np.zeros(0)]
    for sigma, line in zip((noise.row_sigma, noise.column_sigma), np.divmod(pixels, width), strict=True):
        if sigma > 0:
            found, which = np.unique(line, return_inverse=True)
            ones = np.ones(len(pixels)), (np.arange(len(pixels)), which)
            parts.append(sparse.csr_array(ones, shape=(len(pixels), len(found))))
            variances.append(np.full(len(found), sigma**2))
    return sparse.hstack(parts, format="csr"), np.concatenate(variances)


def of_shared(noise: Noise, rows: sparse.csr_array, width: int) -> np.ndarray:
    """What it adds to the covariance (k, k) of functions with derivatives (k, height * width) by pixels."""
    if not noise.is_shared:
        return np.zeros((rows.shape[0],) * 2)
    used = np.unique(rows.indices)
    parts, variance = shared(noise, used, width)
    sums = sparse.csr_array(rows[:, used]) @ parts
    return (sums.multiply(variance).tocsr() @ sums.T).toarray()


def of_points(noise: Noise, places, normals, arc, blur_px, scale: float) -> np.ndarray:
    """Covariance (..., m, m) of crossings along unit normals, px^2 at a contrast of 1 grey level.

    A crossing's error is the second derivative across the edge of the smoothed noise, over that of a step's slope. Of
    noise that depends on y alone it is n_y^2 times that by y, and two of them correlate as the fourth derivative of a
    Gaussian of variance 2 s^2 in the difference of y. Each point stands for a length of edge, over which this is
    averaged: the derivative's integral is known.

    Parameters
    ----------
    places, normals : ndarray, shape (..., m, 2)
        px.
    arc : ndarray, shape (..., m)
        Length of edge that each stands for, px.
    blur_px : float or ndarray, shape (..., m)
        Of the lens.
    scale : float
        Of the locator, px.
    """
    whole = np.zeros((*places.shape[:-1], places.shape[-2]))
    gain = crossing_gain(blur_px, scale) * np.ones(places.shape[:-1])
    for sigma, axis in ((noise.row_sigma, 1), (noise.column_sigma, 0)):
        if sigma > 0:
            apart = places[..., :, None, axis] - places[..., None, :, axis]
            half = np.maximum(arc * np.abs(normals[..., 1 - axis]) / 2, _SHORT * scale)
            one, other = half[..., :, None], half[..., None, :]
            outer, inner = one + other, one - other
            kernel = (
                _curvature(apart + outer, scale) - _curvature(apart + inner, scale)
                - _curvature(apart - inner, scale) + _curvature(apart - outer, scale)
            ) / (4 * one * other)  # fmt: skip
            moved = sigma * gain * normals[..., axis] ** 2
            whole += moved[..., :, None] * moved[..., None, :] * kernel
    return whole


def _curvature(x: np.ndarray, scale: float) -> np.ndarray:
    """Second derivative of a Gaussian of variance 2 scale^2."""
    variance = 2 * scale**2
    return (x**2 / variance - 1) / variance * np.exp(-(x**2) / (2 * variance)) / np.sqrt(2 * np.pi * variance)


def of_lines(noise: Noise, mean, slope, length, normals, blur_px, scale: float) -> np.ndarray:
    """Variance (...) of sums over straight edges of f(t) times the crossing's error at t, px^2 at unit contrast.

    The double integral of f f' and `of_points`, as one over frequencies: f = mean + slope t, t from the edge's middle,
    has a spectrum in closed form.

    Parameters
    ----------
    mean, slope, length : ndarray, shape (...)
        1 / px, 1 / px^2, px.
    normals : ndarray, shape (..., 2)
    blur_px, scale
        As for `of_points`.
    """
    w = _ENDS / scale * (np.arange(_NODES) + 0.5) / _NODES
    spectrum = w**4 * np.exp(-((scale * w) ** 2)) * _ENDS / (scale * _NODES * np.pi)
    found = np.zeros(np.shape(length))
    for sigma, axis in ((noise.row_sigma, 1), (noise.column_sigma, 0)):
        if sigma > 0:
            x = w * np.abs(normals[..., 1 - axis, None]) * length[..., None] / 2
            with np.errstate(divide="ignore", invalid="ignore"):
                lever = np.where(x < 1e-3, x / 3, (np.sin(x) - x * np.cos(x)) / x**2)
            even = mean[..., None] * np.sinc(x / np.pi) * length[..., None]
            odd = slope[..., None] * lever * length[..., None] ** 2 / 2
            found = found + sigma**2 * normals[..., axis] ** 4 * ((even**2 + odd**2) * spectrum).sum(-1)
    return found * crossing_gain(blur_px, scale) ** 2
