"""Noise that is not white: what demosaicking, sharpening, smoothing and resampling make of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from scipy import sparse
from scipy.special import chdtrc

from measure.goodness import WORST
from measure.photo.noise_curve import NoiseCurve
from measure.photo.patches import SIDE, Patches, polynomials, residuals

REACH = 3  # px: the farthest lag
_TAPS = 2 * REACH + 1
_SURFACE = polynomials()[:, :3]


@dataclass(frozen=True, eq=False)
class Correlation:
    """Covariance of pixels so many rows and columns apart, over the variance that the noise curve tells.

    Attributes
    ----------
    kernel : ndarray, shape (7, 7)
        Symmetric about its middle, which holds the variance itself.
    p_value : float
        Of as much correlation in white noise.
    """

    kernel: np.ndarray
    p_value: float

    @property
    def white(self) -> bool:
        """Whether the noise may be white."""
        return self.p_value > WORST

    def covariance(self, rows: np.ndarray, pixels: np.ndarray, sigma: np.ndarray, width: int) -> np.ndarray:
        """Covariance of linear functions of pixels, (k, k).

        Parameters
        ----------
        rows : ndarray, shape (k, P)
            Derivatives by the pixels.
        pixels : ndarray of int, shape (P,)
            Their flat indices in images ``width`` px wide.
        sigma : ndarray, shape (P,)
            Standard deviation of each as the noise curve tells it, grey levels.
        """
        y, x = np.divmod(pixels, width)
        first, shape = (y.min(), x.min()), (int(np.ptp(y)) + 1, int(np.ptp(x)) + 1)
        place, scaled = (y - first[0]) * shape[1] + x - first[1], rows * sigma
        spread = np.empty_like(scaled)
        for row, to in zip(scaled, spread, strict=True):
            image = np.zeros(shape)
            image.flat[place] = row
            to[:] = cv2.filter2D(image, cv2.CV_64F, self.kernel, borderType=cv2.BORDER_CONSTANT).flat[place]
        return scaled @ spread.T

    def covariance_of_many(self, rows: sparse.csr_array, sigma: np.ndarray) -> np.ndarray:
        """The same of many functions, each of a few pixels, (k, k).

        Parameters
        ----------
        rows : csr_array, shape (k, height * width)
        sigma : ndarray, shape (height, width)
        """
        scaled = sparse.coo_array(rows)
        y, x = np.divmod(scaled.col, sigma.shape[1])
        data, whole = scaled.data * sigma.flat[scaled.col], np.zeros((rows.shape[0],) * 2)
        one = sparse.csr_array((data, (scaled.row, scaled.col)), rows.shape)
        for (dy, dx), value in np.ndenumerate(self.kernel):
            to_y, to_x = y + dy - REACH, x + dx - REACH
            seen = (to_y >= 0) & (to_y < sigma.shape[0]) & (to_x >= 0) & (to_x < sigma.shape[1]) & (value != 0)
            to = to_y * sigma.shape[1] + to_x
            whole += (
                value * (sparse.csr_array((data[seen], (scaled.row[seen], to[seen])), rows.shape) @ one.T).toarray()
            )
        return whole


def correlation(patches: Patches, curve: NoiseCurve) -> Correlation:
    """The correlation of the noise in smooth patches.

    Products of what a plane leaves of a patch are sums of the noise's own covariances, since the plane takes its part:
    a linear system, solved for the covariances up to `REACH` px. Where the noise is white they are 0, each with a
    standard error that the same system tells.
    """
    left = residuals(patches) / np.sqrt(np.maximum(curve.variance(patches.level), 1e-12))[:, None, None]
    if not left.size:
        return Correlation(_white(), 1.0)
    seen, (matrix, spread) = _products(left).mean(0), _system()
    inverse = np.linalg.inv(matrix)
    found = inverse @ seen
    error = inverse @ spread @ inverse.T / len(left)
    square = found[1:] @ np.linalg.solve(error[1:, 1:], found[1:])
    kernel = np.zeros((_TAPS, _TAPS))
    for value, (dy, dx) in zip(found, _lags(), strict=True):
        kernel[REACH + dy, REACH + dx] = kernel[REACH - dy, REACH - dx] = value
    return Correlation(kernel, float(chdtrc(len(found) - 1, square)))


def _white() -> np.ndarray:
    kernel = np.zeros((_TAPS, _TAPS))
    kernel[REACH, REACH] = 1.0
    return kernel


@lru_cache(maxsize=1)
def _lags() -> tuple[tuple[int, int], ...]:
    """One of each two opposite lags, 0 first."""
    steps = range(-REACH, REACH + 1)
    return tuple((dy, dx) for dy in range(REACH + 1) for dx in steps if dy > 0 or dx >= 0)


def _products(images: np.ndarray) -> np.ndarray:
    """Sums of products of pixels at each lag in images (n, SIDE, SIDE), (n, lags)."""
    found = []
    for dy, dx in _lags():
        one = images[:, dy:, max(dx, 0) : SIDE + min(dx, 0)]
        other = images[:, : SIDE - dy, max(-dx, 0) : SIDE - max(dx, 0)]
        found.append(np.einsum("nij,nij->n", one, other))
    return np.stack(found, 1)


@lru_cache(maxsize=1)
def _system() -> tuple[np.ndarray, np.ndarray]:
    """Mean of the products for covariances of 1 at each lag, and the products' covariance in white noise."""
    size = SIDE**2
    keep = np.eye(size) - _SURFACE @ _SURFACE.T
    y, x = np.divmod(np.arange(size), SIDE)
    pairs = []
    for dy, dx in _lags():
        which = (y[:, None] - y == dy) & (x[:, None] - x == dx)
        pairs.append(which.astype(float))
    both = [pair if lag == (0, 0) else pair + pair.T for lag, pair in zip(_lags(), pairs, strict=True)]
    seen = [keep @ ((pair + pair.T) / 2) @ keep for pair in pairs]
    matrix = np.array([[np.sum(s * b) for b in both] for s in seen])
    return matrix, 2 * np.array([[np.sum(s * t) for t in seen] for s in seen])
