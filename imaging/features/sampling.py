"""What sampling by pixels does to an edge that lies nearly along their rows or columns.

The locator sums over pixels where it should integrate. By Poisson's formula the sum is the integral and terms in which
the image's spectrum is moved by 2 pi m, m a pair of integers. A straight edge has its spectrum on a line through the
origin along its normal n, so only terms with n nearly along m matter: they move the crossing by a sine of the place's
phase 2 pi m . p, which averages out along an edge that crosses many rows. Of these only m = (1, 0) and (0, 1) are told,
so that m . p are the coordinates: further terms are below 1e-9 px.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from imaging.features.locator import edge_blur

_TABLE = np.linspace(-1, 1, 1025)  # cosine between n and m
_BLUR_STEP, _NO_MORE = 0.02, 1.5  # px: between blurs that are tabled, and beyond which pixels are no longer felt


def sampled_line(middle, tangent, length, blur_px, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean shift along the normal (-t_y, t_x), px, and its slope, of the line through the crossings of a lone edge.

    Parameters
    ----------
    middle : ndarray, shape (..., 2)
        Middle of the used part of the edge, px from the centre of a pixel.
    tangent : ndarray, shape (..., 2)
        Unit direction t.
    length : ndarray, shape (...)
        Of the used part, px.
    blur_px : float or ndarray, shape (...)
        Of the lens, px.
    scale : float
        Of the locator, px.
    """
    phase = 2 * np.pi * middle
    normal = np.stack([-tangent[..., 1], tangent[..., 0]], -1)
    amplitude = amplitudes(normal, blur_px, scale)
    return line_through(amplitude * np.sin(phase), amplitude * np.cos(phase), tangent, length)


def line_through(sine, cosine, periods, length) -> tuple[np.ndarray, np.ndarray]:
    """Mean and slope of the line through shifts along a length (...), px, that are sums of m waves.

    Parameters
    ----------
    sine, cosine : ndarray, shape (..., m)
        Of each wave in the length's middle, times its amplitude, px.
    periods : ndarray, shape (..., m)
        Of each wave along the length, 1 / px.
    """
    x = np.pi * length[..., None] * periods
    with np.errstate(divide="ignore", invalid="ignore"):
        lever = np.where(np.abs(x) < 1e-3, x / 3, (np.sin(x) - x * np.cos(x)) / x**2)
    return (sine * np.sinc(x / np.pi)).sum(-1), (cosine * lever).sum(-1) * 6 / length


def sampled_places(places: np.ndarray, normals: np.ndarray, blur_px, scale: float) -> np.ndarray:
    """Shift (...) along unit normals (..., 2), px, of a lone edge's crossing at places (..., 2), px."""
    return shifted_by(amplitudes(normals, blur_px, scale), places)


def shifted_by(amplitude: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Shifts (...), px, at places (..., 2), px, of these amplitudes."""
    shifts = amplitude * np.sin(2 * np.pi * places)
    return shifts[..., 0] + shifts[..., 1]  # a sum along an axis of two takes several times as long


def amplitudes(cosine: np.ndarray, blur_px, scale: float) -> np.ndarray:
    """The largest shifts, px, by each order along unit normals (..., 2), whose components are its cosines.

    Places are of some blur, one or (...); between blurs linear.
    """
    if np.ndim(blur_px) == 0:
        return np.interp(cosine, _TABLE, _amplitudes(float(blur_px), scale))
    place = np.minimum(np.nan_to_num(np.broadcast_to(blur_px, cosine.shape[:-1])), _NO_MORE)[..., None] / _BLUR_STEP
    first, found = np.floor(place).astype(int), np.zeros(cosine.shape)
    for number in np.unique(first):
        less, more = (_amplitudes(_BLUR_STEP * (number + each), scale) for each in (0, 1))
        here, share = (first == number), place - number
        shift = (1 - share) * np.interp(cosine, _TABLE, less) + share * np.interp(cosine, _TABLE, more)
        found = np.where(here, shift, found)
    return found


@lru_cache(maxsize=128)
def _amplitudes(blur_px: float, scale: float) -> np.ndarray:
    """Largest shift, px, of the crossing by one order for the cosines of `_TABLE`; its sine goes with the phase.

    The step's spectrum is 1 / (i w) times that of the lens' blur and of the pixel's box; the locator's, at
    k = w n + 2 pi m, is -(k . n)^2 exp(-s^2 k^2 / 2). The pole at w = 0 is left out evenly on both sides.
    """
    w, spacing = frequencies(scale)
    cosine = _TABLE[:, None]
    box = np.sinc(w * cosine / (2 * np.pi)) * np.sinc(w * np.sqrt(1 - cosine**2) / (2 * np.pi))
    k2 = w**2 + 4 * np.pi * w * cosine + 4 * np.pi**2
    kernel = (w + 2 * np.pi * cosine) ** 2 * np.exp(-(scale**2) * k2 / 2)
    total = -(np.exp(-((blur_px * w) ** 2) / 2) * box * kernel / w).sum(-1) * spacing / (2 * np.pi)
    return 2 * total * crossing_gain(blur_px, scale)


def frequencies(scale: float) -> tuple[np.ndarray, float]:
    """Where an edge's spectrum is summed, evenly on both sides of 0, and their spacing, rad / px."""
    spacing = 0.2 / max(scale, 1.0)
    w = spacing * (np.arange(int((2 * np.pi + 8 / scale) / spacing)) + 0.5)
    return np.concatenate([-w[::-1], w]), spacing


def crossing_gain(blur_px: float, scale: float) -> float:
    """By how much a unit step's crossing moves for a second derivative that is added to its smoothed image, px^3."""
    return np.sqrt(2 * np.pi) * np.hypot(scale, edge_blur(blur_px)) ** 3
