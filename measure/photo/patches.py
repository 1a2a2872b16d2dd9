"""Smooth patches of a picture: squares that show a gently shaded surface and the noise on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import chdtri, fdtri

SIDE = 7  # px
_ENOUGH = 20_000  # patches: a million pixels
_SURFACE, _BENT = 3, 10  # polynomial terms of a plane, and up to the third degree
_ROUNDED = 0.35  # of a squared step: variance that rounding may make of next to no noise in some patches
_TAIL = 1e-3  # of smooth patches that are left out at each of the two sieves


@dataclass(frozen=True, eq=False)
class Patches:
    """P smooth patches of SIDE x SIDE pixels.

    Attributes
    ----------
    corner : ndarray of int, shape (P, 2)
        (row, column) of each patch's first pixel.
    pixels : ndarray, shape (P, SIDE * SIDE)
        Grey levels.
    level : ndarray, shape (P,)
        Their mean.
    variance : ndarray, shape (P,)
        Unbiased variance of what a polynomial of third degree leaves, grey levels^2.
    freedom : int
        Degrees of freedom of each variance.
    seen : int
        How many patches were looked at.
    """

    corner: np.ndarray
    pixels: np.ndarray
    level: np.ndarray
    variance: np.ndarray
    freedom: int
    seen: int


def smooth_patches(image: np.ndarray, limits: tuple[float, float] = (-np.inf, np.inf), step: float = 0.0) -> Patches:
    """The patches of an image (height, width) in which nothing but a shading and noise is to be seen.

    White noise spreads evenly over the polynomials of second and third degree and all that is finer, an edge does not:
    their ratio tells the smooth patches without favouring quiet ones, for the two are independent. Its own median is
    what it is held against, so that noise that is not white passes, too. Patches with a pixel at ``limits``, where the
    sensor's scale ends, do not count. Levels were rounded to multiples of ``step``; what that makes of little noise is
    let pass.
    """
    corner, pixels = _cut(image)
    seen = len(pixels)
    whole = (pixels > limits[0]).all(1) & (pixels < limits[1]).all(1)
    corner, pixels = corner[whole], pixels[whole]
    told = pixels @ polynomials()
    fine = np.maximum((pixels**2).sum(1) - (told**2).sum(1), 0.0)
    bent = (told[:, _SURFACE:] ** 2).sum(1)
    freedom = pixels.shape[1] - _BENT
    least = max(_ROUNDED * step**2, 1e-10)
    good = _kept(bent, fine, least, _BENT - _SURFACE, freedom)
    good[good] = ~_loud(fine[good] / freedom, pixels[good].mean(1), least, freedom)
    return Patches(corner[good], pixels[good], pixels[good].mean(1), fine[good] / freedom, freedom, seen)


@lru_cache(maxsize=1)
def polynomials() -> np.ndarray:
    """Orthonormal polynomials on a patch up to the third degree, the lowest first, (SIDE * SIDE, 10)."""
    y, x = (part.ravel() / SIDE for part in np.mgrid[:SIDE, :SIDE] - (SIDE - 1) / 2)
    columns = [x**i * y ** (total - i) for total in range(4) for i in range(total, -1, -1)]
    return np.linalg.qr(np.stack(columns, 1))[0]


def _cut(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First pixels (P, 2) and pixels (P, SIDE * SIDE) of patches that tile the image, not all of a large one."""
    height, width = (size // SIDE * SIDE for size in image.shape)
    rows = np.arange(0, height, SIDE)
    step = max(rows.size * (width // SIDE) // _ENOUGH, 1)
    rows = rows[step // 2 :: step]
    bands = [image[row : row + SIDE, :width].reshape(SIDE, -1, SIDE).swapaxes(0, 1) for row in rows]
    if not bands or not width:
        return np.empty((0, 2), int), np.empty((0, SIDE**2))
    corner = np.stack(np.meshgrid(rows, np.arange(0, width, SIDE), indexing="ij"), -1).reshape(-1, 2)
    return corner, np.concatenate(bands).reshape(-1, SIDE**2).astype(float)


def _kept(bent: np.ndarray, fine: np.ndarray, least: float, *freedom: int) -> np.ndarray:
    """Which patches are smooth, bool (P,): their bends no more than the noise, or a variance of ``least``."""
    ratio = bent / freedom[0] / np.maximum(fine / freedom[1], 1e-12)
    noisy = fine > 1e-9
    usual = max(np.median(ratio[noisy]) / fdtri(*freedom, 0.5), 1.0) if noisy.any() else 1.0
    return (ratio < usual * fdtri(*freedom, 1 - _TAIL)) | (bent / freedom[0] < least)


def _loud(variance: np.ndarray, level: np.ndarray, least: float, freedom: int) -> np.ndarray:
    """Patches with more noise than others of their level: texture, or an edge that bends nothing."""
    if variance.size < 20:
        return np.zeros(variance.size, bool)
    order = np.argsort(level)
    usual = np.empty(variance.size)
    for part in np.array_split(order, max(min(variance.size // 60, 12), 1)):
        usual[part] = np.median(variance[part])
    most = chdtri(freedom, _TAIL / 10) / chdtri(freedom, 0.5)
    return variance > np.maximum(usual * most, least)


def residuals(patches: Patches) -> np.ndarray:
    """What a plane leaves of each patch, (P, SIDE, SIDE)."""
    plane = polynomials()[:, :_SURFACE]
    left = patches.pixels - patches.pixels @ plane @ plane.T
    return left.reshape(-1, SIDE, SIDE)
