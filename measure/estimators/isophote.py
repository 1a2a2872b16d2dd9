"""Edge points where the smoothed image takes the mean of the levels on both sides: an isophote at sub-pixel precision.

The levels are those of the pixels beside the edge, a straight line along it on each side. They are linear in the image,
as the smoothed image is, and so what changes sign at the isophote is one linear function of it: the levels' own noise is
in its response, and no level needs to be known. Along the edge it is the line that contours of the smoothed image give.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from measure import status
from measure.estimators.crossing import CrossingLocator, gaussian_rows, places_across
from measure.estimators.strip import pixels_beside
from measure.features.calipers import Caliper, distance_to_segment
from measure.features.layout import Layout
from measure.features.optics import Optics
from planner.features.locator import CLEARANCE, edge_blur

_BAND = 3.0  # how far a side's level reaches from the edge, in units of where it starts
_QUIETEST = 0.7  # a crowded side shows its level no farther from all edges than so much of the farthest that there is
_FEWEST = 8  # pixels that tell a level


def isophote_locator(layout: Layout, index: int, caliper: Caliper) -> tuple[CrossingLocator, str]:
    """Prepare the locator of one straight edge of a layout; `status.CLUTTER` where a side has no level of its own."""
    optics = caliper.optics
    places, normals, gain = caliper.curve()
    basis, sides, state = [], [], status.OK
    for side, sign in enumerate((1, -1)):
        pixels, rows, clear = _side(layout, index, caliper, layout.sides[index, side], sign)
        shade = layout.shade(layout.sides[index, side], caliper.at(caliper.positions, np.zeros(1)))
        basis.append(np.stack([shade, shade * (caliper.positions - _middle(caliper))], 1) / 2)
        sides.append((pixels, rows))
        state = state if clear else status.CLUTTER
    blur = caliper.blur(caliper.positions)
    return _locator(optics, caliper.positions, places, normals, gain, blur, np.concatenate(basis, 1), sides), state


def _locator(optics: Optics, positions, places, normals, gain, blur, basis, sides) -> CrossingLocator:
    """The level less the smoothed image: falls through zero where an edge brightens along the normal."""
    offsets, across, _ = places_across(places, normals, optics.window_px)
    kernel = -gaussian_rows(across, optics.scale_px, optics.shape)
    pixels = np.unique(np.concatenate([kernel.indices, *(side for side, _ in sides)]))
    level, done = np.zeros((basis.shape[1], pixels.size)), 0
    for side, rows in sides:
        level[done : done + len(rows), np.searchsorted(pixels, side)] = rows
        done += len(rows)
    total = np.hypot(optics.scale_px, edge_blur(blur)) * np.ones(len(places))
    return CrossingLocator(
        positions, offsets, pixels, sparse.csr_array(kernel[:, pixels]), np.sqrt(2 * np.pi) * total,
        gain * np.ones(len(places)), basis, level,
    )  # fmt: skip


def _side(
    layout: Layout, index: int, caliper: Caliper, face: int, sign: int
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Pixels (P,) that show one side's level, rows (2, P) that take the level at the edge's middle and its change per
    px from them (relative to the face's shading), and whether they are clear of all edges."""
    start = CLEARANCE * edge_blur(layout.optics.blur_px)
    flat, points, along, across = (part for part in pixels_beside(caliper, _BAND * start))
    clearance = sign * across
    for segment in (*layout.ends[layout.visible], *layout.others):
        if not np.array_equal(segment, layout.ends[index]):
            clearance = np.minimum(clearance, distance_to_segment(points, *segment))
    own = (layout.labels().flat[flat] == face) & (clearance > 0)
    if own.sum() < _FEWEST:
        own = clearance > 0
    limit = min(start, _QUIETEST * clearance[own].max(initial=0.0))
    own &= clearance >= limit
    shade, lever = layout.shade(face, points[own]), along[own] - _middle(caliper)
    design = np.stack([shade, shade * lever], 1)
    if np.ptp(lever) < np.ptp(caliper.positions) / 2:
        design[:, 1] = 0.0  # too short a piece to tell a change along the edge
    return flat[own], np.linalg.pinv(design), bool(limit >= start)


def _middle(caliper: Caliper) -> float:
    return float(caliper.positions.mean())
