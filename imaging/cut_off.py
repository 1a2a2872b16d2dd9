"""Noise that the end of the sensor's scale cuts off. NumPy alone: a recipe (`validation.recipe`) has this file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

MARGIN = 6.0  # standard deviations below the end of the scale within which it is felt


def cut_off(
    level: np.ndarray, variance: np.ndarray, full: float, ndtr: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance (n,) of normal distributions whose part above ``full`` is recorded as ``full``.

    Parameters
    ----------
    level, variance : ndarray, shape (n,)
        Of the whole distributions, grey levels.
    full : float
        The highest grey level.
    ndtr : callable
        The standard normal distribution function.

    Examples
    --------
    >>> from scipy.special import ndtr
    >>> [part.round(6).tolist() for part in cut_off(np.array([255.0]), np.array([4.0]), 255.0, ndtr)]
    [[254.202115], [1.36338]]
    """
    sigma = np.sqrt(variance)
    with np.errstate(divide="ignore", invalid="ignore"):
        below = np.where(sigma > 0, (full - level) / sigma, np.copysign(np.inf, full - level))
    density = np.exp(-(below**2) / 2) / np.sqrt(2 * np.pi)
    capped = np.clip(below, -1e9, 1e9)
    missing = capped * ndtr(below) + density  # mean of (full - x) / sigma where x is below, 0 elsewhere
    square = (1 + capped**2) * ndtr(below) + capped * density
    return full - sigma * missing, sigma**2 * np.maximum(square - missing**2, 0.0)
