"""Closed outlines in a photograph: of areas above a level, above their surroundings, or enclosed by edges."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from measure.find.coarse import Coarse

_LEVELS = 24  # evenly spaced, between the image's extremes
_SHARES = np.arange(5, 100, 10)  # percentiles at which it is cut too
_AROUND = (25, 75)  # px: squares whose mean is the level of the surroundings
_ABOVE = 2.0  # standard deviations of a smoothed level
_EDGES = ((4.0, 10.0), (10.0, 25.0))  # hysteresis of edges, standard deviations of the gradient
_LEAST_LENGTH = 24  # px
_LEAST_SOLID = 0.9  # part of its convex hull that an outline fills
_BORDER = 2  # px


def contours(coarse: Coarse) -> Iterator[np.ndarray]:
    """Outlines (n, 2), coarse px, about convex and clear of the image's border."""
    for mask in _masks(coarse):
        found, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        for outline in found:
            if len(outline) >= _LEAST_LENGTH and _inside(outline, coarse.size) and _convex(outline):
                yield outline[:, 0]


def _masks(coarse: Coarse) -> Iterator[np.ndarray]:
    smooth = coarse.smooth
    some = smooth[:: max(smooth.shape[0] // 500, 1), :: max(smooth.shape[1] // 500, 1)]
    low, high = np.percentile(smooth, [0.02, 99.98])
    levels = np.concatenate([np.linspace(low, high, _LEVELS + 2)[1:-1], np.percentile(some, _SHARES)])
    for level in np.unique(levels):
        yield (smooth > level).view(np.uint8)
    for side in _AROUND:
        around = cv2.blur(smooth, (side, side), borderType=cv2.BORDER_REPLICATE)
        for away in (-_ABOVE * coarse.smooth_noise, _ABOVE * coarse.smooth_noise):
            yield (smooth > around + away).view(np.uint8)
    yield from _enclosed(coarse)


def _enclosed(coarse: Coarse) -> Iterator[np.ndarray]:
    """Areas between edges, whichever way the image changes at them."""
    largest = max(float(np.abs(coarse.gx).max()), float(np.abs(coarse.gy).max()), 1e-12)
    scale = 32000 / largest
    gx, gy = (np.rint(each * scale).astype(np.int16) for each in (coarse.gx, coarse.gy))
    for low, high in _EDGES:
        edges = cv2.Canny(gx, gy, low * coarse.gradient_noise * scale, high * coarse.gradient_noise * scale, None, True)
        yield (cv2.dilate(edges, np.ones((3, 3), np.uint8)) == 0).view(np.uint8)


def _inside(outline: np.ndarray, size: np.ndarray) -> bool:
    x, y, width, height = cv2.boundingRect(outline)
    return x >= _BORDER and y >= _BORDER and x + width <= size[0] - _BORDER and y + height <= size[1] - _BORDER


def _convex(outline: np.ndarray) -> bool:
    """Whether an outline fills its hull; half a pixel around both belongs to them."""
    around = len(outline) / 2
    return cv2.contourArea(outline) + around >= _LEAST_SOLID * (cv2.contourArea(cv2.convexHull(outline)) + around)
