"""The pixels beside an edge that its likelihood is of."""

from __future__ import annotations

import numpy as np

from imaging.geometry.segments import distance_to_segment, pixels_along, within_reach
from measure.features.calipers import Caliper
from measure.features.layout import Layout

NEARER = 1.5  # a pixel belongs to an edge if it is this many times nearer to it than to a crowding one
LEAST_BLUR = 0.3  # px: a sharper edge is not resolved by the pixels
_MARGIN = 2.0  # px that a lens may make a strip wider in its recording


def pixels_beside(caliper: Caliper, half_width: float) -> tuple[np.ndarray, ...]:
    """Pixels (flat indices) within ``half_width`` px of the part of an edge that is used.

    With them their ideal coordinates (P, 2), px, and those in the caliper (along, across).
    """
    shape = caliper.optics.shape
    ends = caliper.positions[[0, -1]]
    used = caliper.optics.recorded(caliper.at(np.linspace(*ends, 17), np.zeros(17)))
    bow = distance_to_segment(used, used[0], used[-1]).max()
    y, x = pixels_along(used[0], used[-1], half_width + bow + _MARGIN, shape)
    points = caliper.optics.ideal(np.stack([x, y], 1).astype(float))
    along, across = caliper.coordinates(points)
    near = (
        (np.abs(across) <= half_width) & (along >= caliper.positions[0] - 0.5) & (along <= caliper.positions[-1] + 0.5)
    )
    return (y * shape[1] + x)[near], points[near], along[near], across[near]


def are_own(layout: Layout, index: int, points: np.ndarray, across: np.ndarray, clear: float) -> np.ndarray:
    """Which pixels (P, 2), ``across`` px beside an edge, are clear of the others by ``clear`` px, or nearer to it.

    The latter of edges alone that share no corner with it.
    """
    keep = np.ones(len(points), bool)
    # an edge may be required twice, once for each of its corners
    task = [ends for ends in layout.ends[layout.visible] if not np.array_equal(ends, layout.ends[index])]
    apart = {segment.tobytes() for segment in layout.apart[index]}
    for segment in within_reach(np.concatenate([np.reshape(task, (-1, 2, 2)), layout.others]), points, clear):
        away = distance_to_segment(points[keep], *segment)
        crowded = segment.tobytes() in apart  # too near all along: nothing would be left, so it is flagged instead
        keep[keep] = (away > clear) | (crowded & (away > NEARER * np.abs(across[keep])))
    return keep
