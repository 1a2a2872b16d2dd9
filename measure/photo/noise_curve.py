"""Noise against grey level in one picture, from what smooth patches of it show (EMVA 1288's straight line)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from measure.photo.noise import noise_sigma
from measure.photo.patches import Patches, polynomials, smooth_patches
from measure.photo.rounding import before_rounding
from scenes import Noise
from scenes.ranges import LEAST_SIGMA

_GROUPS, _LEAST = 16, 30  # groups of patches of like level, and how many patches make one
_CHUNK = 2**16  # pixels looked at at a time
_FEW = 20  # patches that are too few to tell the noise
_CLEAR = 5.0  # standard errors from which the noise depends on the level
_FALLING = 0.8  # ratio of standard deviations, at the brightest and the darkest level, that no sensor makes
_LOWEST = 0.05  # of the variance at the darkest level: what a falling line ends at
_SURFACE = polynomials()[:, :3]


@dataclass(frozen=True)
class NoiseCurve:
    """Variance of a grey level: ``dark`` + ``gain`` (level - ``dark_level``) + ``step`` squared over 12, grey levels^2.

    Attributes
    ----------
    dark, gain : float
        Variance at ``dark_level``, rounding not included, and how it grows with the level (falls, if negative).
    dark_level : float
        The lowest level that was seen; below it the variance is the same.
    step : float
        What levels were rounded to; 0 for real numbers.
    bits : int or None
        So many make the sensor's scale; None for real numbers, and where levels are not 1 apart.
    """

    dark: float
    gain: float
    dark_level: float
    step: float
    bits: int | None

    @property
    def falls(self) -> bool:
        """Whether the noise is less where it is brighter, as a tone curve makes it that was not undone."""
        return self.gain < 0

    def variance(self, levels: np.ndarray) -> np.ndarray:
        """Variance of the noise at grey levels, rounding included, grey levels^2.

        Examples
        --------
        >>> NoiseCurve(2.0, 0.1, 10.0, 0.0, None).variance(np.array([0.0, 10.0, 60.0]))
        array([2., 2., 7.])
        """
        light = np.maximum(np.asarray(levels) - self.dark_level, 0.0)
        return np.maximum(self.dark + self.gain * light, _LOWEST * self.dark) + self.step**2 / 12

    @property
    def noise(self) -> Noise:
        """The sensor's noise for the estimators; where it falls, the darkest level's for all."""
        rounded = 0.0 if self.bits is not None else self.step**2 / 12
        sigma = float(np.sqrt(self.dark + rounded))
        sigma = max(sigma, LEAST_SIGMA) if sigma else 0.0  # of levels far below any sensor's
        return Noise(sigma=sigma, bits=self.bits, gain=max(self.gain, 0.0), dark_level=self.dark_level)


def noise_curve(image: np.ndarray, full: float | None = None) -> NoiseCurve:
    """The noise of an image (height, width), grey levels, from itself; its scale ends at ``full`` if anywhere.

    Examples
    --------
    >>> level = np.linspace(20, 200, 400) * np.ones((300, 1))
    >>> noisy = level + np.sqrt(1 + 0.05 * level) * np.random.default_rng(1).standard_normal(level.shape)
    >>> bool(np.all(np.abs(noise_curve(noisy).variance(level) / (1 + 0.05 * level) - 1) < 0.05))
    True
    """
    scale = scale_of(image, full)
    return curve_of(smooth_patches(image, scale.limits, scale.step), scale, image)


def curve_of(patches: Patches, scale: Scale, image: np.ndarray) -> NoiseCurve:
    """The same from the image's smooth patches; from second differences of the image where these are too few."""
    step, bits = scale.step, scale.bits if scale.step == 1 else None
    if len(patches.level) < _FEW:
        return NoiseCurve(max(noise_sigma(image) ** 2 - step**2 / 12, 0.0), 0.0, 0.0, step, bits)
    level, variance, error = _groups(patches, step)
    lowest = float(patches.level.min())
    dark, gain, clear = _line(level - lowest, variance, error)
    falls = clear < -_CLEAR and dark + gain * float(np.ptp(level)) < _FALLING**2 * dark
    if not (clear > _CLEAR or falls):
        dark, gain = float(np.average(variance, weights=error**-2.0)), 0.0
    return NoiseCurve(max(dark, 0.0), gain, max(lowest, 0.0), step, bits)


class Scale(NamedTuple):
    """What the levels of an image are multiples of (0 for real numbers), bits of their scale, and where it ends."""

    step: float
    bits: int | None
    limits: tuple[float, float]


def scale_of(image: np.ndarray, full: float | None = None) -> Scale:
    """The scale of an image's levels as they tell it; ``full`` is its end where that is known.

    Examples
    --------
    >>> scale_of(np.array([[0, 16], [32, 4000.0]]))[:2], scale_of(np.array([[0.5, 1.0]]))
    ((16.0, 12), Scale(step=0.0, bits=None, limits=(-inf, inf)))
    """
    step, bits = _rounding(np.asarray(image).ravel())
    if full is None:
        full = None if bits is None else 2.0**bits - 1
    return Scale(step, bits, (-np.inf, np.inf) if full is None else (0.0, full * (1 - 1e-6)))


def _rounding(flat: np.ndarray) -> tuple[float, int | None]:
    low, high = float(flat.min()), float(flat.max())
    if low < 0 or high > 65535:
        return 0.0, None
    used = np.zeros(2**16, bool)
    for at in range(0, flat.size, _CHUNK):
        part = flat[at : at + _CHUNK]
        whole = part.astype(np.uint16)
        if not (part == whole).all():
            return 0.0, None
        used[whole] = True
    step = float(np.gcd.reduce(np.diff(np.flatnonzero(used)), initial=0)) or 1.0
    return step, next(bits for bits in (8, 10, 12, 14, 16) if high < 2**bits)


def _groups(patches: Patches, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Level, variance before rounding and its standard error of patches of like level, each (G,)."""
    parts = np.array_split(np.argsort(patches.level, kind="stable"), _count(len(patches.level)))
    level = np.array([patches.level[part].mean() for part in parts])
    seen = np.array([patches.variance[part].mean() for part in parts])
    before = [
        before_rounding(patches.pixels[part], _SURFACE, float(v), step) if step else float(v)
        for part, v in zip(parts, seen, strict=True)
    ]
    freedom = np.array([part.size for part in parts]) * patches.freedom
    return level, np.array(before), np.maximum(seen, step**2 / 12 + 1e-12) * np.sqrt(2 / freedom)


def _count(patches: int) -> int:
    return max(min(patches // _LEAST, _GROUPS), 1)


def _line(level: np.ndarray, variance: np.ndarray, error: np.ndarray) -> tuple[float, float, float]:
    """Variance at level 0, its slope, and the slope in standard errors: those of each point as the line says."""
    if level.size < 3 or np.ptp(level) <= 0:
        return float(variance.mean()), 0.0, 0.0
    design, relative, expected = (
        np.stack([np.ones_like(level), level], 1),
        error / np.maximum(variance, 1e-12),
        variance,
    )
    for _ in range(4):
        weight = 1 / np.maximum(relative * np.maximum(expected, 1e-3 * variance.max()), 1e-12)
        fit = np.linalg.lstsq(design * weight[:, None], variance * weight, rcond=None)[0]
        expected = np.maximum(design @ fit, 0.0)
    spread = np.linalg.inv((design * weight[:, None]).T @ (design * weight[:, None]))
    return float(fit[0]), float(fit[1]), float(fit[1] / np.sqrt(spread[1, 1]))
