"""What an edge locator finds at a limb, whose profile is no step, and how precisely.

Smoothed by a Gaussian of w (lens, pixel and locator together) the level y^p inside the limb has the second derivative
Gamma(p + 1) w^(p - 2) exp(-x^2 / 4) D_(1-p)(-x) / sqrt(2 pi) at x = y / w, with D a parabolic cylinder function
(Whittaker's); p = 0 is the step, whose crossing is at 0.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import gamma, pbdv

from imaging.contours.shading import Profile
from imaging.features.locator import edge_blur

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_STEPS, _LONGEST = 20, 0.5  # of Newton's method; w
_SETTLED = 1e-10  # w
_FARTHEST = 3.0  # w: beyond, what crosses zero is no edge
_TOLD = 4.0  # w


class Crossing(NamedTuple):
    """Where the second derivative crosses zero beside n points of a limb.

    Attributes
    ----------
    shift : ndarray, shape (n,)
        Outwards, px: the locator's bias against the limb. NaN where there is no crossing.
    slope : ndarray, shape (n,)
        Third derivative there, outwards, grey levels / px^3; positive where the body is brighter.
    """

    shift: np.ndarray
    slope: np.ndarray

    def variance(self, noise_variance, scale: float) -> np.ndarray:
        """Variance of a point's place, px^2, in white noise (grey levels^2) smoothed by the locator's scale, px."""
        return 3 * np.asarray(noise_variance) / (16 * np.pi * scale**6) / self.slope**2


def limb_crossing(profile: Profile, beyond, blur_px, scale: float, curvature=0.0, fourth=0.0) -> Crossing:
    """The crossing of the gradient locator.

    Parameters
    ----------
    profile : Profile
        Of the body's level, n points.
    beyond : float or ndarray, shape (n,)
        Level beside the body, grey levels.
    blur_px : float or ndarray, shape (n,)
        Standard deviation of the lens' blur, px.
    scale : float
        Of the locator's, px.
    curvature : float or ndarray, shape (n,)
        Of the limb's image (`Strand.curvature`), 1 / px: to first order w^2 / 2 of it is added inwards.
    fourth : float or ndarray, shape (n,)
        Fourth cumulant of the blur across the limb, px^4: of a pixel's box (`box_cumulant`). It moves no step, but
        what is uneven, and is taken to first order.

    Examples
    --------
    >>> step = Profile(np.array([[100.0]]), np.zeros(1))
    >>> found = limb_crossing(step, 20.0, 0.6, 1.0)
    >>> from imaging.features.locator import kappa2
    >>> bool(abs(found.shift) < 1e-9), bool(np.isclose(found.variance(4.0, 1.0), kappa2(1.0, 0.6) * 4.0 / 80**2))
    (True, True)
    """
    width = np.hypot(edge_blur(blur_px), scale) * np.ones(len(profile.coefficients))
    terms = profile.coefficients.astype(float).copy()
    terms[:, 0] -= beyond
    powers = np.arange(terms.shape[1]) / 2
    weights = terms * gamma(powers + 1) * width[:, None] ** powers
    square = np.broadcast_to(np.asarray(fourth, float) / 24 / width**4, len(terms))
    x, step, slope = np.zeros(len(terms)), np.full(len(terms), np.inf), np.zeros(len(terms))
    live = np.flatnonzero(np.isfinite(weights).all(1) & weights.any(1))
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            value, slope[live] = _second_and_third(weights[live], square[live], x[live])
            step[live] = np.clip(np.where(slope[live] != 0, value / slope[live], 0.0), -_LONGEST, _LONGEST)
            x[live] -= step[live]
            live = live[(np.abs(step[live]) > _SETTLED) & (np.abs(x[live]) < _TOLD)]
            if not live.size:
                break
        slope = -slope * np.exp(-(x**2) / 4) / (np.sqrt(2 * np.pi) * width**3)
        lost = ~((np.abs(x) < _FARTHEST) & (np.abs(step) < 1e-6) & (slope != 0))
    return Crossing(
        np.where(lost, np.nan, -width * x - width**2 * np.asarray(curvature) / 2), np.where(lost, 0.0, slope)
    )


def box_cumulant(normals: np.ndarray) -> np.ndarray:
    """Fourth cumulant of a pixel's box across lines of unit normals (..., 2), px^4, (...)."""
    return -(normals**4).sum(-1) / 120


def _second_and_third(weights: np.ndarray, square: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Second and third derivative (n,) at x, in w, but for a common factor; ``square`` the fourth cumulant's share."""
    count = weights.shape[1]
    terms = _cylinder_functions(count)(np.clip(x, -_TOLD, _TOLD)).reshape(len(x), 4, count)
    second, third, sixth, seventh = np.einsum("nkp,np->kn", terms, weights)
    return second + square * sixth, third + square * seventh


@lru_cache(maxsize=8)
def _cylinder_functions(count: int) -> BSpline:
    """D_(k - p / 2)(-x) for |x| up to `_TOLD`, k of 1, 2, 5, 6 and p below ``count``, to 1e-13: a table's are quick."""
    from scipy.interpolate import make_interp_spline  # slow to load, and rarely needed

    nodes = np.linspace(-_TOLD, _TOLD, 385)
    index = np.add.outer([1.0, 2.0, 5.0, 6.0], -np.arange(count) / 2).ravel()
    return make_interp_spline(nodes, pbdv(index, -nodes[:, None])[0], 7)
