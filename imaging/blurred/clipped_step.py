"""What the end of the sensor's scale does to the blurred image of an edge between two bright faces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import ndtr

from imaging.blurred.boundaries import Boundaries
from imaging.sensor import headroom, recorded
from scenes import Noise

_REACH, _SPACING = 6.0, 0.2  # of the locator's scale: quadrature by the trapezoidal rule


def clipped(noise: Noise, near: Boundaries, blur: np.ndarray, scale: float) -> Callable | None:
    """Second and third derivative that the cut at the end of the scale adds, as a function of the places' moves.

    Parameters
    ----------
    near : Boundaries
        Only the places' own edges are looked at: others are taken to be far.
    blur : ndarray, shape (M,)
        Standard deviation of lens and pixel at each place, px; the levels are cut off after it.
    scale : float
        That of the locator, px; it smooths what was cut off.

    Returns
    -------
    callable or None
        From moves (M,), px, to two arrays (M,); None where nothing is cut off.
    """
    rows = np.flatnonzero(near.own & (near.sides.max(-1) > headroom(noise)))
    if not rows.size:
        return None
    place = near.place[rows]
    u = scale * np.arange(-_REACH, _REACH + _SPACING / 2, _SPACING)
    width = blur[place, None]
    after = ndtr(u / width)
    density = np.exp(-((u / width) ** 2) / 2) / (np.sqrt(2 * np.pi) * width)
    (left, right), (rise, climb) = (np.moveaxis(v[rows, :, None], 1, 0) for v in (near.sides, near.kinks))
    level = (left + rise * u) * (1 - after) + (right + climb * u) * after + width**2 * (climb - rise) * density
    level = level + noise.dark_level
    lost = recorded(noise, level).level - level

    def derivatives(moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = (moved[place, None] - u) / scale
        kernel = lost * np.exp(-(x**2) / 2) * _SPACING / np.sqrt(2 * np.pi)
        second, third = np.zeros_like(moved), np.zeros_like(moved)
        second[place] = (kernel * (x**2 - 1)).sum(-1) / scale**2
        third[place] = (kernel * (3 * x - x**3)).sum(-1) / scale**3
        return second, third

    return derivatives
