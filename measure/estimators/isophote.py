"""Edge points where the smoothed image takes the mean of the levels on both sides: an isophote at sub-pixel precision.

Each side's level is a straight line along the edge through the pixels beside it, times the face's shading; where that
is unknown, because the light is, a slope across the edge is fitted too, from a wider band. Smoothed image and levels
are linear in the pixels, and so is their difference, whose change of sign is the edge point: the levels' own noise is
in its response. Through the points of an edge goes the line that the contour of the smoothed image at that level gives
(`skimage.measure.find_contours`), for a whole stack of images at once.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imaging.features.locator import CLEARANCE, MIN_CONTRAST, edge_blur, isophote_kappa2, kappa2
from imaging.geometry.segments import distance_to_segment, within_reach
from measure.estimators.beside import SideLevel, misled
from measure.estimators.crossing import CrossingLocator, gaussian_rows, reached
from measure.estimators.kinds import EstimatorKind
from measure.estimators.separate import PointEstimator, SeparateEstimator, calipers_for, measurable, thinned
from measure.estimators.strip import HALF_WIDTH
from measure.estimators.strip_pixels import pixels_beside
from measure.estimators.windows import places_across
from measure.features.calipers import Caliper
from measure.features.layout import BACKGROUND, Layout
from scenes import status

TRIM = 3.0  # standard deviations of an edge from which 0.1 % of its contrast is left: where corners and levels begin
_BAND = 3.5  # how far a side's level reaches from the edge, in units of where it starts
_QUIETEST = 0.7  # a crowded side shows its level no farther from all edges than so much of the farthest that there is
_FEWEST = 8  # pixels that tell a level


def isophote_locator(layout: Layout, index: int, caliper: Caliper) -> tuple[CrossingLocator, str]:
    """Prepare the locator of one edge of a layout; with it ``clutter`` where a side has no level of its own, or ``ok``.

    The function that crosses zero is the level less the smoothed image.
    """
    optics = caliper.optics
    places, normals, gain = caliper.curve()
    offsets, across, _ = places_across(places, normals, optics.window_px)
    sides = [_side(layout, index, caliper, sign) for sign in (1, -1)]
    smoothed = gaussian_rows(across, optics.scale_px, optics.shape)
    pixels, kernel = reached(-smoothed, *(side.pixels for side in sides))
    level = np.zeros((6, pixels.size))
    for k, side in enumerate(sides):
        level[3 * k : 3 * k + 3, np.searchsorted(pixels, side.pixels)] = side.rows / 2
    blur = caliper.blur(caliper.positions) * np.ones(len(places))
    least = MIN_CONTRAST * np.sqrt(isophote_kappa2(optics.scale_px, blur) / kappa2(optics.scale_px, blur))
    return CrossingLocator(
        positions=caliper.positions,
        offsets=offsets,
        pixels=pixels,
        kernel=kernel,
        slope_to_contrast=np.sqrt(2 * np.pi) * np.hypot(optics.scale_px, edge_blur(blur)),
        gain=gain * np.ones(len(places)),
        basis=np.concatenate([side.basis for side in sides], 1),
        level=level,
        least_contrast=float(least.mean()),
        optics=optics,
    ), status.OK if all(side.clear for side in sides) and not _misled(layout, index, caliper, sides) else status.CLUTTER


class _Level(NamedTuple):
    """How one side's level is told: its mean, its change along the edge and across it.

    Attributes
    ----------
    pixels : ndarray of int, shape (P,)
    rows : ndarray, shape (3, P)
        The level from them.
    basis : ndarray, shape (m, 3)
        What each position takes of it.
    clear : bool
        Whether the pixels are clear of all edges.
    side : SideLevel
    """

    pixels: np.ndarray
    rows: np.ndarray
    basis: np.ndarray
    clear: bool
    side: SideLevel


def _misled(layout: Layout, index: int, caliper: Caliper, levels: list[_Level]) -> bool:
    return misled(layout, index, caliper, (levels[0].side, levels[1].side), caliper.optics.scale_px)


def _side(layout: Layout, index: int, caliper: Caliper, sign: int) -> _Level:
    """The level on one side of an edge."""
    face = int(layout.sides[index, (1 - sign) // 2])
    start = TRIM * edge_blur(layout.optics.most_blur_px)
    even = not layout.optics.dimmed if face == BACKGROUND else layout.shadings[face] is not None
    flat, points, along, across = pixels_beside(caliper, _BAND * start if even else max(HALF_WIDTH, _BAND * start))
    clearance = sign * across
    edges = np.concatenate([layout.ends[layout.visible], layout.others])
    for segment in within_reach(edges, points, float(clearance.max(initial=0.0))):
        if not np.array_equal(segment, layout.ends[index]):
            clearance = np.minimum(clearance, distance_to_segment(points, *segment))
    own = (layout.face_at(flat) == face) & (clearance > 0)
    if own.sum() < _FEWEST:
        own = clearance > 0  # a face too thin for pixels of its own: what is seen beyond it
    limit = min(start, _QUIETEST * clearance[own].max(initial=0.0))
    own &= clearance >= limit
    lever, away, middle = along[own], sign * across[own], caliper.positions.mean()
    columns = np.stack([np.ones_like(lever), lever - middle, away], 1)
    told = True, _extent(lever) > np.ptp(caliper.positions) / 2, not even and _extent(away) > start
    rows = np.linalg.pinv(layout.shade(face, points[own])[:, None] * columns * told)
    return _Level(
        flat[own], rows, _smoothed(layout, face, caliper, sign), bool(limit >= start and own.sum() >= _FEWEST),
        SideLevel(sign, face, points[own], lever, across[own], told),
    )  # fmt: skip


def _extent(places: np.ndarray) -> float:
    return float(np.ptp(places)) if places.size else 0.0


def _smoothed(layout: Layout, face: int, caliper: Caliper, sign: int) -> np.ndarray:
    """Twice what one side's face adds to the smoothed image on the expected edge, by the terms of its level, (m, 3).

    A level P + g u at the distance u within the face gives half of P + g sigma sqrt(2 / pi) on the edge itself.
    """
    width = np.hypot(caliper.optics.scale_px, edge_blur(caliper.blur(caliper.positions)))
    inward = np.sqrt(2 / np.pi) * width * np.ones(caliper.positions.size)
    there, inside, outside = (
        layout.shade(face, caliper.at(caliper.positions, np.full(1, float(u)))) for u in (0, sign, -sign)
    )
    mean = there + inward * (inside - outside) / 2
    return np.stack([mean, mean * (caliper.positions - caliper.positions.mean()), there * inward], 1)


def _prepared(layout: Layout, threshold: float) -> SeparateEstimator:
    """Each edge by its isophote; `clutter` where one of its sides has no level of its own."""
    parts, found = [], []
    for index, caliper in enumerate(calipers_for(layout, 4, TRIM / CLEARANCE)):
        part = None
        if measurable(caliper):
            locator, state = isophote_locator(layout, index, thinned(caliper, layout.optics.scale_px))
            part = PointEstimator(replace(caliper, positions=locator.positions), locator)
            caliper = replace(part.caliper, status=status.worst(caliper.status, state))
        found.append(caliper)
        parts.append(part)
    return SeparateEstimator(tuple(found), tuple(parts))


ISOPHOTE = EstimatorKind(_prepared, capture_px=0.5, exact_px=0.003, local=True, separate=True)
