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
from measure.photo.patches import SIDE, Patches, residuals

REACH = 3  # px: the farthest lag that patches tell
FAR = 10  # px: the farthest that runs of patches tell, of which covariances are told by distance
_RUN, _ENOUGH = 5, 60  # patches in a row, and how many runs tell anything
_LEAST = 0.1  # of the variance that the noise curve tells: runs of less tell next to nothing
_SPECTRUM, _TURNS = 64, 10  # frequencies along each axis, and turns of `_possible`
_RINGS = (5.0, 7.0, FAR)  # px: up to where covariances beyond REACH count as equal


@dataclass(frozen=True, eq=False)
class Correlation:
    """Covariance of pixels so many rows and columns apart, over the variance that the noise curve tells.

    Attributes
    ----------
    kernel : ndarray, shape (k, k)
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
            to_y, to_x = y + dy - self.kernel.shape[0] // 2, x + dx - self.kernel.shape[1] // 2
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
    standard error that the same system tells. Where it is not, a camera's own smoothing may reach farther than a patch
    shows: runs of smooth patches tell the same up to `FAR` px, beyond `REACH` by distance alone.
    """
    left = residuals(patches) / np.sqrt(np.maximum(curve.variance(patches.level), 1e-12))[:, None, None]
    if not left.size:
        return Correlation(_kernel(np.ones(1), _lags()[:1]), 1.0)
    lags, (matrix, spread) = _lags(), _system(_lags(), SIDE)
    inverse = np.linalg.inv(matrix)
    found = inverse @ _products(left, lags).mean(0)
    error = inverse @ spread @ inverse.T / len(left)
    square = found[1:] @ np.linalg.solve(error[1:, 1:], found[1:])
    told = Correlation(_kernel(found, lags), float(chdtrc(len(found) - 1, square)))
    runs = np.empty((0, SIDE, 0)) if told.white else _runs(patches, curve)
    if len(runs) < _ENOUGH:
        return told
    lags = _lags() + _rings()
    farther = np.linalg.solve(_system(lags, _RUN * SIDE)[0], _products(runs, lags).mean(0))
    if farther[0] < found[0]:  # what reaches farther adds to the variance, so these runs are quieter than the rest
        farther *= found[0] / max(farther[0], _LEAST)
    farther[len(_lags()) :] = np.maximum(farther[len(_lags()) :], 0.0)
    return Correlation(_possible(_kernel(farther, lags)), told.p_value)


def _possible(kernel: np.ndarray) -> np.ndarray:
    """The nearest covariances whose spectrum is nowhere below 0, so that no variance is: clipped in turns in frequency
    and to the kernel's lags; what is left is made up for by white noise."""
    size, middle = kernel.shape[0], kernel.shape[0] // 2
    whole = np.zeros((_SPECTRUM, _SPECTRUM))
    for _ in range(_TURNS):
        whole[:size, :size] = kernel
        spectrum = np.fft.fft2(np.roll(whole, (-middle, -middle), (0, 1))).real
        kernel = np.roll(np.fft.ifft2(np.maximum(spectrum, 0.0)).real, (middle, middle), (0, 1))[:size, :size]
    whole[:size, :size] = kernel
    missing = np.fft.fft2(np.roll(whole, (-middle, -middle), (0, 1))).real.min()
    kernel[middle, middle] += max(-missing, 0.0)
    return kernel


def _runs(patches: Patches, curve: NoiseCurve) -> np.ndarray:
    """What a plane leaves of runs of smooth patches along a row, in units of the noise, (n, SIDE, _RUN * SIDE)."""
    row, column = patches.corner.T
    order = np.lexsort((column, row))
    first, last = order[: 1 - _RUN], order[_RUN - 1 :]
    found = order[np.arange(max(len(order) - _RUN + 1, 0))[:, None] + np.arange(_RUN)]
    found = found[(row[first] == row[last]) & (column[last] - column[first] == (_RUN - 1) * SIDE)]
    found = found[(column[found[:, 0]] // SIDE) % _RUN == 0] if len(found) > 4 * _ENOUGH * _RUN else found
    pixels = patches.pixels[found].reshape(-1, _RUN, SIDE, SIDE).swapaxes(1, 2).reshape(-1, SIDE * _RUN * SIDE)
    plane = _plane(_RUN * SIDE)
    left = (pixels - pixels @ plane @ plane.T) / np.sqrt(np.maximum(curve.variance(pixels.mean(1)), 1e-12))[:, None]
    return left.reshape(-1, SIDE, _RUN * SIDE)


Lags = tuple[tuple[tuple[int, int], ...], ...]


def _kernel(values: np.ndarray, lags: Lags) -> np.ndarray:
    """Covariances (2 k + 1, 2 k + 1) from those of groups of lags."""
    reach = max(max(map(abs, lag)) for group in lags for lag in group)
    kernel = np.zeros((2 * reach + 1,) * 2)
    for value, group in zip(values, lags, strict=True):
        for dy, dx in group:
            kernel[reach + dy, reach + dx] = kernel[reach - dy, reach - dx] = value
    return kernel


@lru_cache(maxsize=1)
def _lags() -> Lags:
    """One of each two opposite lags, each a group of its own, 0 first."""
    steps = range(-REACH, REACH + 1)
    return tuple(((dy, dx),) for dy in range(REACH + 1) for dx in steps if dy > 0 or dx >= 0)


@lru_cache(maxsize=1)
def _rings() -> Lags:
    """Groups of the lags beyond, by distance; one of each two opposite ones."""
    steps, rings = range(-FAR, FAR + 1), [[] for _ in _RINGS]
    for dy, dx in ((dy, dx) for dy in range(FAR + 1) for dx in steps if dy > 0 or dx >= 0):
        ring = int(np.searchsorted(_RINGS, np.hypot(dy, dx)))
        if max(dy, abs(dx)) > REACH and ring < len(_RINGS):
            rings[ring].append((dy, dx))
    return tuple(map(tuple, rings))


def _products(images: np.ndarray, lags: Lags) -> np.ndarray:
    """Sums of products of pixels at each group of lags in images (n, SIDE, width), (n, groups)."""
    return np.stack([sum(_product(images, lag) for lag in group) for group in lags], 1)


def _product(images: np.ndarray, lag: tuple[int, int]) -> np.ndarray:
    (dy, dx), (height, width) = lag, images.shape[1:]
    if dy >= height:
        return np.zeros(len(images))
    one = images[:, dy:, max(dx, 0) : width + min(dx, 0)]
    other = images[:, : height - dy, max(-dx, 0) : width - max(dx, 0)]
    return np.einsum("nij,nij->n", one, other)


@lru_cache(maxsize=2)
def _plane(width: int) -> np.ndarray:
    """Orthonormal basis of planes on SIDE x width pixels."""
    y, x = (part.ravel() for part in np.mgrid[:SIDE, :width])
    return np.linalg.qr(np.stack([np.ones(x.size), x - x.mean(), y - y.mean()], 1))[0]


@lru_cache(maxsize=2)
def _system(lags: Lags, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the products in SIDE x width pixels for covariances of 1 at each group of lags, and the products'
    covariance in white noise."""
    plane, size = _plane(width), SIDE * width
    keep = np.eye(size) - plane @ plane.T
    y, x = np.divmod(np.arange(size), width)
    apart = np.stack([y[:, None] - y, x[:, None] - x], -1)
    pairs = [sum((apart == lag).all(-1) for lag in group).astype(float) for group in lags]
    both = [pair if group == ((0, 0),) else pair + pair.T for group, pair in zip(lags, pairs, strict=True)]
    seen = [keep @ ((pair + pair.T) / 2) @ keep for pair in pairs]
    matrix = np.array([[np.sum(s * b) for b in both] for s in seen])
    return matrix, 2 * np.array([[np.sum(s * t) for t in seen] for s in seen])
