"""Are the errors of a circle, or of a line, linear in the noise, as the variance that is propagated says?

Where two edges are near, of a rim or a border and of what lies beside it, noise may decide at a place which of them is
found, and with it from where a circle is looked for again. Its crossings then jump from one to the other, which no
derivative by the pixels of a noise-free image tells. Drawn images answer it: what is found in them beside what the
derivative gives of the same noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.ndimage import binary_dilation

from imaging.colour import by_raw, raw_variance
from imaging.row_noise import shared
from measure.features.optics import Optics

_DRAWN, _AT_ONCE = 128, 16  # images; both variances are of the same noise: their ratio is known better than each
_AROUND = 4  # px beside the pixels looked at: in a drawn image the circle may be looked for elsewhere
_ALIKE = 1.25  # ratio of variances, full and to first order, up to which they are alike
_BIAS = 0.3  # standard deviations of the mean error, that `ok` allows
_FOUND = 0.5  # part of the drawn images in which the circle must be found


@dataclass(frozen=True, eq=False)
class Stack:
    """Grey levels of n images, shape (n, pixels)."""

    levels: np.ndarray

    def __len__(self) -> int:
        return len(self.levels)

    def __getitem__(self, which: np.ndarray) -> Stack:
        return Stack(self.levels[which])

    def at(self, pixels: np.ndarray) -> np.ndarray:
        """Levels (n, P) of pixels (P,), flat indices."""
        return self.levels[:, pixels]


@dataclass(frozen=True, eq=False)
class Drawn:
    """n images of which noise is drawn where it matters.

    Attributes
    ----------
    clean : ndarray, shape (pixels,)
        Noise-free grey levels.
    region : ndarray of int, shape (R,)
        Flat indices of the pixels that have noise, in order.
    noise : ndarray, shape (n, R)
    """

    clean: np.ndarray
    region: np.ndarray
    noise: np.ndarray

    def __len__(self) -> int:
        return len(self.noise)

    def __getitem__(self, which: np.ndarray) -> Drawn:
        return Drawn(self.clean, self.region, self.noise[which])

    def at(self, pixels: np.ndarray) -> np.ndarray:
        """Levels (n, P) of pixels (P,), flat indices."""
        column = np.minimum(np.searchsorted(self.region, pixels), self.region.size - 1)
        return self.clean[pixels] + np.where(self.region[column] == pixels, self.noise[:, column], 0.0)

    def whole(self, shape: tuple[int, int]) -> np.ndarray:
        """Images of this shape, (n, height, width)."""
        levels = np.tile(self.clean, (len(self), 1))
        levels[:, self.region] += self.noise
        return levels.reshape(len(self), *shape)

    def first_order(self, response: sparse.csr_array) -> np.ndarray:
        """Errors (n, p) of what answers to the noise by a linear response (p, pixels)."""
        return (sparse.csr_array(response[:, self.region]) @ self.noise.T).T


def drawn(clean: np.ndarray, pixels: np.ndarray, optics: Optics) -> Iterator[Drawn]:
    """Drawn images, some at once, of noise about the pixels that are looked at; always the same ones.

    Parameters
    ----------
    clean : ndarray, shape (height, width)
    pixels : ndarray of int
        Flat indices.
    optics : Optics
    """
    rng, region = np.random.default_rng(0), _around(pixels, clean.shape)
    from_raw, sigma = _noise_of(clean, region, optics)
    for _ in range(0, _DRAWN, _AT_ONCE):
        noise = sigma * rng.standard_normal((_AT_ONCE, sigma.size))
        yield Drawn(clean.ravel(), region, noise if from_raw is None else noise @ from_raw.T)


def _noise_of(clean: np.ndarray, region: np.ndarray, optics: Optics) -> tuple[sparse.csr_array | None, np.ndarray]:
    """Standard deviations (Q,) of what is independent, and what makes the pixels (R,) of a region of it, (R, Q)."""
    level, colour = clean.ravel()[region], optics.colour
    if colour is None:
        variance = optics.noise_at(level)
        sigma = np.sqrt(np.full(region.size, optics.noise_variance) if variance is None else variance)
        if not optics.sensor.is_shared:
            return None, sigma
        parts, known = shared(optics.sensor, region, clean.shape[1])
        own = sparse.eye_array(region.size, format="csr")
        return sparse.hstack([own, parts], format="csr"), np.concatenate([sigma, np.sqrt(known)])
    taken, raw = by_raw(colour, region, clean.shape)
    return taken, np.sqrt(raw_variance(optics.noise, clean.ravel()[raw], raw, clean.shape[1]))


def _around(pixels: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Flat indices, in order, of pixels of an image of this shape and those up to `_AROUND` beside them."""
    row, column = np.unravel_index(pixels, shape)
    low = np.array([row.min(), column.min()]) - _AROUND
    box = np.zeros(np.array([row.max(), column.max()]) + _AROUND + 1 - low, bool)
    box[row - low[0], column - low[1]] = True
    row, column = np.nonzero(binary_dilation(box, iterations=_AROUND)) + low[:, None]
    inside = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
    return np.ravel_multi_index((row[inside], column[inside]), shape)


def is_linear(linear: np.ndarray, full: np.ndarray, found: np.ndarray) -> bool:
    """Whether errors have the variances of a linear response, and no mean beside it.

    Parameters
    ----------
    linear, full : ndarray, shape (n, p)
        Errors of p parameters in n drawn images, to first order and in full.
    found : ndarray of bool, shape (n,)
        In which images the circle or line is.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal((128, 1))
    >>> jumps = noise + 6 * (noise > 1.5)
    >>> is_linear(noise, 1.02 * noise, noise[:, 0] < 9), is_linear(noise, jumps, noise[:, 0] < 9)
    (True, False)
    """
    if not linear.any():
        return True  # without noise there is nothing to ask
    if found.mean() < _FOUND or not np.isfinite(full[found]).all():
        return False
    linear, full = linear[found], full[found]
    spread = np.where(linear.std(0) > 0, linear.std(0), np.finfo(float).tiny)
    alike = np.abs(np.log(np.maximum(full.std(0), np.finfo(float).tiny) / spread)) <= np.log(_ALIKE) / 2
    return bool((alike & (np.abs((full - linear).mean(0)) <= _BIAS * spread)).all())
