"""The gradient across an edge beside one of its pixels, and where it is largest.

A place found so is a property of the smoothed image: from any pixel near it, it is the same.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyval, polyvander

TRUNCATE = 5  # standard deviations at which the kernels end
_FARTHEST = 0.75  # px from the pixel to the top: half a diagonal, and a bit
_TERMS = 7  # of the polynomial


def profile_kernel(scale: float, normal: np.ndarray) -> np.ndarray:
    """From k x k pixels to the gradient along a unit normal (x, y) at the middle one and its derivative beside it.

    The derivative is sampled at Chebyshev's places within `_FARTHEST`; the polynomial through them, at half a pixel, is
    true to 1e-5 of the slope at scale 1. Each kernel sums to exactly zero, so that a constant image gives 0.
    """
    radius = int(np.ceil(TRUNCATE * scale))
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    places = _FARTHEST * np.cos(np.pi * (np.arange(_TERMS) + 0.5) / _TERMS)
    dx, dy = (part.reshape(-1, 1) - np.append(0.0, places) * n for part, n in ((x, normal[0]), (y, normal[1])))
    gauss = np.exp(-(dx**2 + dy**2) / (2 * scale**2)) / (2 * np.pi * scale**2)
    across = (dx * normal[0] + dy * normal[1]) / scale
    kernel = gauss * np.where(np.arange(_TERMS + 1) == 0, across / scale, (across**2 - 1) / scale**2)
    kernel -= gauss * (kernel.sum(0) / gauss.sum(0))
    kernel[:, 1:] = kernel[:, 1:] @ np.linalg.inv(polyvander(places, _TERMS - 1)).T
    return kernel


def top(profiles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where the gradient is largest, by Newton's method from the top of the Gaussian at the pixel.

    Parameters
    ----------
    profiles : ndarray, shape (k, 1 + _TERMS)
        Gradient at the pixel, and its derivative as a polynomial in the distance from the pixel, px.

    Returns
    -------
    shift, gradient, curvature : ndarray, shape (k,)
        Distance to the top, px, the gradient there and its second derivative.
    good : ndarray of bool, shape (k,)
        Whether there is a top within a pixel.
    """
    gradient, *second = np.ascontiguousarray(profiles.T)
    second, powers = np.array(second), np.arange(_TERMS, dtype=profiles.dtype)[:, None]
    third = (second * powers)[1:]
    curve = gradient * third[0] - second[0] ** 2  # of the gradient's logarithm, a parabola on a clean edge
    start = np.clip(-gradient * second[0] / np.where(curve < 0, curve, -np.inf), -1, 1)
    curvature = polyval(start, third, tensor=False)
    good = curvature * gradient < 0
    fall = np.where(good, curvature, np.inf)
    shift = start - polyval(start, second, tensor=False) / fall
    shift = np.clip(shift, -1, 1)
    shift = shift - polyval(shift, second, tensor=False) / fall
    good &= np.abs(shift) < 1
    shift = np.where(good, shift, 0.0)
    return shift, gradient + shift * polyval(shift, second / (powers + 1), tensor=False), fall, good


def top_kernel(kernel: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """The kernel of the second derivative that far from the pixel, shape (k, pixels)."""
    return polyvander(shift, _TERMS - 1) @ kernel[:, 1:].T
