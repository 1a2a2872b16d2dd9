"""What the sensor makes of light: the expected grey level and the variance of its noise (EMVA 1288)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from imaging.cut_off import MARGIN, cut_off
from scenes import Noise

_EVEN = 0.7  # grey levels of noise that rounding adds a twelfth to, wherever the level lies
_QUIETEST = 5  # grey levels that less noise reaches


class Levels(NamedTuple):
    """Expected grey level, darkness included, and variance (not sigma) of its noise over repeated pictures."""

    level: np.ndarray
    noise_variance: np.ndarray


def shot_noise(noise: Noise, signal: np.ndarray) -> np.ndarray:
    """Variance that the light's own noise adds at grey levels above darkness: gain x signal, and the excess of a sensor
    that is not linear.

    >>> shot_noise(Noise(sigma=1.0, gain=0.1, excess=[(0, 0), (10, 2)]), np.array([-1.0, 5.0, 20.0]))
    array([0. , 1.5, 4. ])
    """
    lit = np.maximum(signal, 0.0)
    straight = noise.shot_gain * lit
    return straight + np.interp(lit, *zip(*noise.excess, strict=True)) if noise.excess else straight


def _shot_slope(noise: Noise, signal: np.ndarray) -> np.ndarray:
    """Its derivative by the signal."""
    slope = np.where(signal > 0, noise.shot_gain, 0.0)
    if not noise.excess:
        return slope
    signals, excess = np.array(noise.excess).T
    bends = np.concatenate([[0.0], np.diff(excess) / np.diff(signals), [0.0]])
    return slope + bends[np.searchsorted(signals, signal)]


def recorded(noise: Noise, level: np.ndarray) -> Levels:
    """What the sensor records of a noise-free image (grey levels, darkness included).

    EMVA 1288: sigma_dark^2 + gain (level - dark level) + 1/12 for the rounding, and the excess of a sensor that is not
    linear. Near the end of the scale a normal distribution is cut off at 2^bits - 1, which lowers mean and variance.
    The cut at 0 is left out, for the level of darkness keeps the noise away from it; the fixed pattern does not vary.
    """
    level = np.asarray(level, float)
    full = full_scale(noise)
    if noise.gain == 0 and not (level > full - MARGIN * math.sqrt(noise.variance)).any():
        return Levels(level, np.full(level.shape, noise.variance))
    variance = noise.variance + shot_noise(noise, level - noise.dark_level)
    near = level > full - MARGIN * np.sqrt(variance)
    if not near.any():
        return Levels(level, variance)
    level, variance = level.copy(), np.array(np.broadcast_to(variance, level.shape))
    level[near], variance[near] = cut_off(level[near], variance[near], full, ndtr)
    return Levels(level, variance)


def sensitivity(noise: Noise, level: np.ndarray) -> np.ndarray:
    """Derivative of the `recorded` level by the noise-free one (grey levels): below 1 where the scale ends.

    Of the mean of a normal distribution N(level, v(level)) that is cut off at the full scale F:
    Phi(b) - phi(b) v' / (2 sqrt(v)) with b = (F - level) / sqrt(v).

    Examples
    --------
    >>> sensitivity(Noise(sigma=2.0, bits=8), np.array([100.0, 255.0]))
    array([1. , 0.5])
    """
    level = np.asarray(level, float)
    sigma = np.sqrt(np.maximum(noise.variance + shot_noise(noise, level - noise.dark_level), 1e-300))
    below = (full_scale(noise) - level) / sigma
    grows = _shot_slope(noise, level - noise.dark_level) / (2 * sigma)
    return ndtr(below) - np.exp(-(below**2) / 2) / np.sqrt(2 * np.pi) * grows


def squared_errors(noise: Noise, level: np.ndarray, like: Levels) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of (x - m)^2 / v over pictures, of what is recorded (x) of noise-free levels (n,).

    ``like`` holds m and v. Normal noise with that mean and variance has 1 and 2; near the end of the scale both are
    sums over the grey levels, or over an eighth of a standard deviation where that is more. Where noise is less than
    rounding spreads evenly, both depend on where between two grey levels a level lies: sums over these.
    """
    mean, variance, full = np.ones(level.shape), np.full(level.shape, 2.0), full_scale(noise)
    sigma = np.sqrt(np.maximum(noise.variance + shot_noise(noise, level - noise.dark_level) - 1 / 12, 1e-12))
    if np.isinf(full):
        return mean, variance
    quiet = sigma < _EVEN
    if quiet.any():
        mean[quiet], variance[quiet] = _rounded(
            sigma[quiet], level[quiet], like.level[quiet], like.noise_variance[quiet]
        )
    near = level > full - MARGIN * sigma
    if not near.any():
        return mean, variance
    widest = float(sigma[near].max())
    cell = max(1.0, widest / 8)
    values = full - cell * np.arange(np.ceil(2 * MARGIN * widest / cell) + 2)
    below = ndtr((values - cell / 2 - level[near, None]) / sigma[near, None])
    probability = -np.diff(below, axis=1, prepend=1.0)
    squares = (values - like.level[near, None]) ** 2 / like.noise_variance[near, None]
    mean[near] = (probability * squares).sum(1)
    variance[near] = (probability * squares**2).sum(1) - mean[near] ** 2
    return mean, variance


def _rounded(sigma: np.ndarray, level: np.ndarray, mean: np.ndarray, variance: np.ndarray):
    """As `squared_errors`, of normal noise (n,) that is rounded to whole grey levels."""
    values = np.rint(level)[:, None] + np.arange(-_QUIETEST, _QUIETEST + 1)
    away = (values - level[:, None]) / sigma[:, None]
    half = 0.5 / sigma[:, None]
    probability = ndtr(away + half) - ndtr(away - half)
    squares = (values - mean[:, None]) ** 2 / variance[:, None]
    found = (probability * squares).sum(1)
    return found, (probability * squares**2).sum(1) - found**2


def full_scale(noise: Noise) -> float:
    """The highest grey level; infinite without digits."""
    return np.inf if noise.bits is None else 2.0**noise.bits - 1


def headroom(noise: Noise) -> float:
    """Signal (grey levels above darkness) up to which nothing is cut off at the end of the scale.

    Signal + 6 sqrt(variance + gain signal) = full scale - darkness, solved for the signal; it may be negative.
    """
    room = full_scale(noise) - noise.dark_level
    if not np.isfinite(room):
        return np.inf
    half = MARGIN**2 * noise.shot_gain / 2
    return float(room + half - np.sqrt(half * (half + 2 * room) + MARGIN**2 * noise.variance))
