"""Edge points where the smoothed image takes the mean of the levels on both sides: an isophote at sub-pixel precision.

Each side's level is a straight line along the edge through the pixels beside it (times the face's shading, where the
light is known). Smoothed image and levels are linear in the pixels, and so is their difference, whose change of sign is
the edge point: the levels' own noise is in its response. Through the points of an edge goes the line that the contour
of the smoothed image at that level gives (`skimage.measure.find_contours`), for a whole stack of images at once.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from measure import status
from measure.estimators.crossing import CrossingLocator, gaussian_rows, places_across
from measure.estimators.strip import pixels_beside
from measure.features.calipers import Caliper, distance_to_segment
from measure.features.layout import Layout
from planner.features.locator import CLEARANCE, MIN_CONTRAST, edge_blur, isophote_kappa2, kappa2

TRIM = 3.0  # standard deviations of the smoothed edge left out at a corner: a contour there is 0.1 % of them off
_BAND = 3.0  # how far a side's level reaches from the edge, in units of where it starts
_QUIETEST = 0.7  # a crowded side shows its level no farther from all edges than so much of the farthest that there is
_FEWEST = 8  # pixels that tell a level


def isophote_locator(layout: Layout, index: int, caliper: Caliper) -> tuple[CrossingLocator, str]:
    """Prepare the locator of one edge of a layout; with it ``clutter`` where a side has no level of its own, or ``ok``.

    The function that crosses zero is the level less the smoothed image.
    """
    optics = caliper.optics
    places, normals, gain = caliper.curve()
    offsets, across, _ = places_across(places, normals, optics.window_px)
    kernel = -gaussian_rows(across, optics.scale_px, optics.shape)
    sides = [_side(layout, index, caliper, sign) for sign in (1, -1)]
    pixels = np.unique(np.concatenate([kernel.indices, *(used for used, *_ in sides)]))
    level = np.zeros((4, pixels.size))
    for k, (used, rows, *_) in enumerate(sides):
        level[2 * k : 2 * k + 2, np.searchsorted(pixels, used)] = rows / 2
    blur = caliper.blur(caliper.positions) * np.ones(len(places))
    least = MIN_CONTRAST * np.sqrt(isophote_kappa2(optics.scale_px, blur) / kappa2(optics.scale_px, blur))
    return CrossingLocator(
        positions=caliper.positions,
        offsets=offsets,
        pixels=pixels,
        kernel=sparse.csr_array(kernel[:, pixels]),
        slope_to_contrast=np.sqrt(2 * np.pi) * np.hypot(optics.scale_px, edge_blur(blur)),
        gain=gain * np.ones(len(places)),
        basis=np.concatenate([basis for _, _, basis, _ in sides], 1),
        level=level,
        least_contrast=float(least.mean()),
    ), status.OK if all(clear for *_, clear in sides) else status.CLUTTER


def _side(layout: Layout, index: int, caliper: Caliper, sign: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """The level on one side of an edge: pixels (P,) and rows (2, P) that take its mean and its change along the edge
    from them, the basis (m, 2) that takes it to the positions, and whether the pixels are clear of all edges."""
    face, middle = layout.sides[index, (1 - sign) // 2], caliper.positions.mean()
    start = CLEARANCE * edge_blur(layout.optics.blur_px)
    flat, points, along, across = pixels_beside(caliper, _BAND * start)
    clearance = sign * across
    for segment in (*layout.ends[layout.visible], *layout.others):
        if not np.array_equal(segment, layout.ends[index]):
            clearance = np.minimum(clearance, distance_to_segment(points, *segment))
    own = (layout.labels().flat[flat] == face) & (clearance > 0)
    if own.sum() < _FEWEST:
        own = clearance > 0  # a face too thin for pixels of its own: what is seen beyond it
    limit = min(start, _QUIETEST * clearance[own].max(initial=0.0))
    own &= clearance >= limit

    lever = along[own] - middle
    columns = layout.shade(face, points[own])[:, None] * np.stack([np.ones_like(lever), lever], 1)
    if not own.any() or np.ptp(lever) < np.ptp(caliper.positions) / 2:
        columns[:, 1] = 0.0  # too short a piece to tell a change along the edge
    lever = caliper.positions - middle
    basis = _smoothed(layout, face, caliper, sign)[:, None] * np.stack([np.ones_like(lever), lever], 1)
    return flat[own], np.linalg.pinv(columns), basis, bool(limit >= start and own.sum() >= _FEWEST)


def _smoothed(layout: Layout, face: int, caliper: Caliper, sign: int) -> np.ndarray:
    """Twice what a face of mean level 1 on one side adds to the smoothed image at the expected edge's positions, (m,).

    A level P + g u at the distance u within the face gives half of P + g sigma sqrt(2 / pi) on the edge itself.
    """
    optics, none = caliper.optics, np.zeros(1)
    width = np.hypot(optics.scale_px, edge_blur(caliper.blur(caliper.positions)))
    there, inside, outside = (layout.shade(face, caliper.at(caliper.positions, none + u)) for u in (0, sign, -sign))
    return there + np.sqrt(2 / np.pi) * width * (inside - outside) / 2
