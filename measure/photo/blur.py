"""How blurred each side of a polygon is: motion and astigmatism blur sides of different directions differently."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from measure.estimators.coverage import NODE_WEIGHTS, NODES, density, half_plane
from measure.estimators.strip_pixels import LEAST_BLUR, pixels_beside
from measure.features.calipers import Caliper, edge_calipers
from measure.features.layout import Layout
from measure.goodness import p_value
from measure.photo.noise_curve import NoiseCurve
from measure.photo.tone_curve import UNTOLD, ToneCurve, together, tone_curve

_MOST = 8_000  # pixels of a side
_NEAR, _BLURS = 4.0, 4.0  # px, and blurs, to each side of an edge that are looked at
_STEPS, _SETTLED = 12, 1e-4
_WIDEST = 8.0  # px
_FEWEST = 60  # pixels
_UNTOLD = (*(np.nan,) * 5, UNTOLD)
_ALIKE = 1e-3  # probability of sides so different if they are alike


@dataclass(frozen=True, eq=False)
class SideBlur:
    """Blur of each of E sides.

    Attributes
    ----------
    sigma, error : ndarray, shape (E,)
        Standard deviation of a Gaussian, px, and of its error; NaN where it is not told.
    squares, freedom : ndarray, shape (E,)
        Chi-square of what the likeliest edge leaves, and its degrees of freedom.
    bow : ndarray, shape (E,)
        The likeliest bow of the side over its standard error.
    tone : ToneCurve
        That all sides tell together.
    """

    sigma: np.ndarray
    error: np.ndarray
    squares: np.ndarray
    freedom: np.ndarray
    bow: np.ndarray
    tone: ToneCurve

    @property
    def p_value(self) -> float:
        """Goodness of fit of straight sides with a Gaussian blur each and white noise; NaN where a side is not told."""
        if not np.isfinite(self.sigma).all():
            return float("nan")
        squares, one = np.append(self.squares, self.bow**2), np.ones(self.bow.size)
        return float(p_value(squares[None], np.append(self.freedom, one)[None])[0])

    @property
    def common(self) -> float:
        """The blur of all sides, if they have one, px; NaN where none is told."""
        told = np.isfinite(self.sigma)
        return float(np.average(self.sigma[told], weights=self.error[told] ** -2)) if told.any() else float("nan")

    @property
    def differs(self) -> bool:
        """Whether the sides are not equally blurred."""
        told = np.isfinite(self.sigma)
        square = np.sum(((self.sigma[told] - self.common) / self.error[told]) ** 2)
        return bool(told.sum() > 1 and chdtrc(told.sum() - 1, square) < _ALIKE)


def side_blur(image: np.ndarray, layout: Layout, curve: NoiseCurve) -> SideBlur:
    """Blur of each side of a layout that lies on its sides to a pixel or so.

    The likeliest edge in the pixels beside the middle part of each side: place, direction, Gaussian blur under square
    pixels, and levels that change linearly along and across on both sides.
    """
    optics = layout.optics
    calipers = edge_calipers(layout, _NEAR + _BLURS * optics.blur_px, 0.0)
    *told, tones = zip(*(_side(image, caliper, curve) for caliper in calipers), strict=True)
    return SideBlur(*(np.array(each) for each in told), together(tones))


def _side(image: np.ndarray, caliper: Caliper, curve: NoiseCurve) -> tuple:
    """The fields of `SideBlur` of one side."""
    if not caliper.positions.size:
        return _UNTOLD
    sigma = max(caliper.optics.blur_px, LEAST_BLUR)
    flat, _, along, across = pixels_beside(caliper, _NEAR + _BLURS * sigma)
    step = max(flat.size // _MOST, 1)
    flat, along, across = flat[::step], along[::step], across[::step]
    if flat.size < _FEWEST:
        return _UNTOLD
    levels = image.flat[flat]
    root = 1 / np.sqrt(np.maximum(curve.variance(levels), 1e-9))
    lever = (along - along.mean()) / max(float(np.ptp(along)), 1.0)
    offset, tilt, bow = 0.0, 0.0, 0.0
    for _ in range(_STEPS):
        place = across - offset - tilt * lever - bow * _bowed(lever)
        design, contrast = _columns(caliper.normal, place, lever, sigma, levels * root, root)
        fit, *_ = np.linalg.lstsq(design * root[:, None], levels * root, rcond=None)
        if not abs(contrast) > 0:
            return _UNTOLD
        change = np.clip(fit[:4], -0.5, 0.5)
        offset, tilt, sigma, bow = np.array([offset, tilt, sigma, bow]) + change
        if not LEAST_BLUR / 3 < sigma < _WIDEST or abs(offset) > _NEAR:
            return _UNTOLD
        if abs(change[2]) < _SETTLED:
            break
    weighted = design * root[:, None]
    spread = np.linalg.pinv(weighted.T @ weighted)
    left = levels - design @ fit
    tone = tone_curve(design, design @ fit, left, root, 1)
    squares, freedom = float(np.sum((left * root) ** 2)), flat.size - fit.size
    return sigma, max(np.sqrt(spread[2, 2]), 1e-6), squares, freedom, bow / np.sqrt(spread[3, 3]), tone


def _bowed(lever: np.ndarray) -> np.ndarray:
    return 1 - 4 * lever**2


def _columns(normal, place, lever, sigma: float, seen, root) -> tuple[np.ndarray, float]:
    """Derivatives of the levels by place, tilt, blur, bow and six coefficients of them, (P, 10); the contrast."""
    nodes = (place[:, None] + NODES @ normal) / sigma
    inside = half_plane(nodes) @ NODE_WEIGHTS
    thin = density(nodes) / sigma
    step, wider = thin @ NODE_WEIGHTS, -(thin * nodes) @ NODE_WEIGHTS
    rising = (sigma**2 + 1 / 12) * step
    terms = np.stack([np.ones_like(place), lever, place], 1)
    bent = np.zeros_like(terms)
    bent[:, 2] = rising
    linear = np.concatenate([terms * inside[:, None] + bent, terms * (1 - inside)[:, None] - bent], 1)
    fit, *_ = np.linalg.lstsq(linear * root[:, None], seen, rcond=None)
    contrast = (fit[0] - fit[3]) + (fit[1] - fit[4]) * lever
    moving = np.stack(
        [-contrast * step, -contrast * step * lever, contrast * wider, -contrast * step * _bowed(lever)], 1
    )
    return np.concatenate([moving, linear], 1), float(fit[0] - fit[3])
