"""How much of a pixel lies within one or two half-planes, as a blurring lens and a square pixel see it."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, owens_t

_X, _W = np.polynomial.legendre.leggauss(4)
NODES = np.stack(np.meshgrid(_X / 2, _X / 2), -1).reshape(-1, 2)  # within a pixel, px
NODE_WEIGHTS = np.outer(_W, _W).ravel() / 4
_FAR = 7.0  # standard deviations beyond which a half-plane is complete


def half_plane(u: np.ndarray) -> np.ndarray:
    """Blurred half-plane at u standard deviations inside its line."""
    return ndtr(u)


def density(u: np.ndarray) -> np.ndarray:
    """Derivative of `half_plane`."""
    return np.exp(-u * u / 2) / np.sqrt(2 * np.pi)


def wedge(h: np.ndarray, k: np.ndarray, rho: float) -> np.ndarray:
    """Blurred intersection of two half-planes, h and k standard deviations inside their lines.

    The bivariate normal distribution function with correlation rho, the cosine of the angle between the inner
    normals, by Owen's T (Owen 1956); the plain product where a line is far away. Parallel lines leave the smaller
    half-plane, or the strip between them.
    """
    product = ndtr(h) * ndtr(k)
    near = (np.abs(h) < _FAR) & (np.abs(k) < _FAR)
    if abs(rho) >= 1 - 1e-12 or not near.any():
        return np.minimum(ndtr(h), ndtr(k)) if rho > 0 else np.maximum(ndtr(h) - ndtr(-k), 0.0)
    h, k = (np.where(np.abs(x[near]) < 1e-9, 1e-9, x[near]) for x in (h, k))
    root = np.sqrt((1 - rho) * (1 + rho))
    value = (ndtr(h) + ndtr(k)) / 2 - owens_t(h, (k - rho * h) / (h * root)) - owens_t(k, (h - rho * k) / (k * root))
    product[near] = value - np.where(h * k < 0, 0.5, 0.0)
    return product


def wedge_slope(h: np.ndarray, k: np.ndarray, rho: float) -> np.ndarray:
    """Derivative of `wedge` by h."""
    root = np.sqrt(max((1 - rho) * (1 + rho), 1e-24))
    return density(h) * ndtr((k - rho * h) / root)
