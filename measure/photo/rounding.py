"""Noise under rounding: how much of it there was before grey levels became whole numbers.

Where noise spreads over several levels rounding adds a twelfth of a squared step to its variance (Sheppard). Below half
a step it does not: a flat surface shows no noise at all, or much, as its level lies between two numbers. What was
rounded is then taken for what it is, an interval: the most likely planes and the most likely sigma are those that make
the intervals most probable.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

_WELL_SPREAD = 0.6  # steps of noise from which Sheppard's correction is good to 1e-6
_STEPS = 400
_SETTLED = 2e-5  # of sigma, in one step
_ENOUGH = 400  # patches
_LEAST = 0.02  # steps: what is less makes no difference


def before_rounding(pixels: np.ndarray, surface: np.ndarray, variance: float, step: float = 1.0) -> float:
    """Variance of the noise that surfaces had before they were rounded, grey levels^2.

    Parameters
    ----------
    pixels : ndarray, shape (P, m)
        Rounded grey levels of P patches.
    surface : ndarray, shape (m, k)
        Orthonormal columns: any smooth patch is their sum.
    variance : float
        Of what a smooth surface leaves of the rounded pixels.
    step : float
        What was rounded to.
    """
    sheppard = variance - step**2 / 12
    if sheppard > (_WELL_SPREAD * step) ** 2:
        return sheppard
    some = pixels[:: max(len(pixels) // _ENOUGH, 1)] / step
    if not len(some):
        return 0.0
    return step**2 * _likeliest(some, surface, np.sqrt(max(variance / step**2 - 1 / 12, 0.15**2)))


def _likeliest(pixels: np.ndarray, surface: np.ndarray, sigma: float) -> float:
    """Most likely variance, in steps^2, by expectation and maximisation; what the planes take of it is put back."""
    count, terms = surface.shape
    mean = pixels @ surface @ surface.T
    for _ in range(_STEPS):
        first, second = _within(pixels - mean, sigma)
        mean = mean + first @ surface @ surface.T
        flat = first - first @ surface @ surface.T
        spread = np.mean(second - first**2 + flat**2) * count / (count - terms * _told(second - first**2, sigma))
        settled = abs(np.sqrt(spread) - sigma) < _SETTLED * sigma
        sigma = float(np.sqrt(max(spread, _LEAST**2)))
        if settled:
            break
    return sigma**2


def _told(left: np.ndarray, sigma: float) -> float:
    """Part of what unrounded pixels tell that rounded ones do."""
    return float(np.clip(1 - np.mean(left) / sigma**2, 0.0, 1.0))


def _within(centre: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean and mean square of normal noise that lies within half a step of ``centre``."""
    low, high = (centre - 0.5) / sigma, (centre + 0.5) / sigma
    flip = low > 0  # the tails are told apart on the left
    low, high = np.where(flip, -high, low), np.where(flip, -low, high)
    mass = ndtr(high) - ndtr(low)
    d_low, d_high = (np.exp(-(u**2) / 2) / np.sqrt(2 * np.pi) for u in (low, high))
    safe = np.maximum(mass, 1e-280)
    first = np.where(mass > 1e-280, (d_low - d_high) / safe, high)
    second = np.where(mass > 1e-280, 1 + (low * d_low - high * d_high) / safe, high**2)
    return sigma * np.where(flip, -first, first), sigma**2 * second
