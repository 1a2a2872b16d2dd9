"""Uneven light and vignetting: how the levels beside a polygon's sides change, told by smooth patches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from imaging.blurred.arrangement import Region
from imaging.geometry.segments import distance_to_segment
from measure.features.layout import Layout
from measure.photo.noise_curve import NoiseCurve
from measure.photo.patches import SIDE, Patches

MOST = 2  # order of a region's level
_FAR = 40.0  # px from the sides up to which patches tell
_CLEAR = 2.5  # blurs, and half a patch's diagonal, from the sides at which they show no edge
_FEWEST = 12
_SURE = 0.003  # probability of as much unevenness in an even region


def orders(patches: Patches, layout: Layout, curve: NoiseCurve) -> tuple[int, int]:
    """Orders of the levels of background and face: 0 even, 1 linear, 2 quadratic; what the patches need."""
    corners = layout.faces[0]
    middle = patches.corner[:, ::-1] + (SIDE - 1) / 2
    inside = _inside(middle, corners)
    away = np.min([distance_to_segment(middle, *ends) for ends in layout.ends], axis=0) if len(middle) else np.empty(0)
    near = (away < _FAR) & (away > SIDE / np.sqrt(2) + _CLEAR * layout.optics.blur_px)
    error = np.sqrt(np.maximum(curve.variance(patches.level), 1e-9)) / SIDE
    return tuple(
        _order(middle[near & which], patches.level[near & which], error[near & which]) for which in (~inside, inside)
    )


def shaded(layout: Layout, background: int, face: int) -> Layout:
    """The layout of a polygon with levels of at least such orders on both sides."""
    arrangement, corners = layout.arrangement, layout.faces[0]
    margin = np.array([-_FAR, _FAR])[:, None]
    around = np.concatenate([corners.min(0) + margin[:1], corners.max(0) + margin[1:]])
    regions = (
        Region.flat(around, background),
        Region.flat(corners, max(face, arrangement.regions[1].order)),
    )
    return replace(layout, arrangement=replace(arrangement, regions=regions))


def _order(places: np.ndarray, level: np.ndarray, error: np.ndarray) -> int:
    """The lowest order beyond which a region's levels show nothing."""
    if len(level) < _FEWEST:
        return 0
    x, y = ((places - places.mean(0)) / max(float(np.ptp(places, axis=0).max()), 1.0)).T
    columns = [[np.ones_like(x)], [x, y], [x * x, x * y, y * y]]
    left = []
    for order in range(MOST + 1):
        design = np.stack([column for part in columns[: order + 1] for column in part], 1) / error[:, None]
        fit = np.linalg.lstsq(design, level / error, rcond=None)[0]
        left.append(float(np.sum((level / error - design @ fit) ** 2)))
    noisy = max(left[-1] / max(len(level) - 6, 1), 1.0)  # noise that is not white scatters more
    for order in (MOST, MOST - 1):
        gained = (left[order - 1] - left[order]) / noisy
        if chdtrc(len(columns[order]), gained) < _SURE:
            return order
    return 0


def _inside(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Which places (n, 2) lie within a convex polygon (k, 2)."""
    ends = zip(corners, np.roll(corners, -1, 0), strict=True)
    away = np.array([(b - a)[0] * (places - a)[:, 1] - (b - a)[1] * (places - a)[:, 0] for a, b in ends])
    return (away > 0).all(0) | (away < 0).all(0)
