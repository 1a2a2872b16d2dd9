"""Whether the levels that pixels beside an edge tell are those at the edge, as far as the scene knows.

An estimator of single edges takes each side for a level that changes as its face is lit. That may be wrong: a print,
the end of the sensor's scale; and where more is seen than faces of one convex body before darkness a shadow on the
floor, light from a wall, an obstacle. The scene's own levels at the same pixels (`measure.features.looks`) tell by how
much, and what that moves the edge by.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imaging.features.locator import edge_blur, information_bound
from imaging.models.bias import NEGLIGIBLE
from imaging.sensor import recorded
from measure.features.calipers import Caliper
from measure.features.layout import Layout
from measure.features.looks import Looks

_NEAR = np.array([0.21, 0.67, 1.38])  # medians of the thirds of half a normal distribution: what a blur feels
_PLACES = 9  # along an edge
_MOST = 600  # pixels of a side that are asked for their levels


class SideLevel(NamedTuple):
    """P pixels that tell the level on one side of an edge, and how.

    Attributes
    ----------
    sign : int
        1 for the side that the caliper's normal points to, -1 for the other.
    face : int
        Of the layout.
    points : ndarray, shape (P, 2)
        Ideal px.
    along, across : ndarray, shape (P,)
        Their places in the caliper, px.
    terms : tuple of bool
        Whether the level may differ from 0, change along the edge, and change across it.
    """

    sign: int
    face: int
    points: np.ndarray
    along: np.ndarray
    across: np.ndarray
    terms: tuple[bool, bool, bool]


def misled(layout: Layout, index: int, caliper: Caliper, sides: tuple[SideLevel, SideLevel], scale_px: float) -> bool:
    """Whether an edge is found elsewhere than it is, by more than what is negligible beside its noise at best.

    Never where the layout does not know what the scene shows. What disturbs the classic locators disturbs others, too,
    where things hide or shade each other.

    Parameters
    ----------
    layout : Layout
    index : int
        Which edge of it.
    caliper : Caliper
        Its positions tell the part that is used.
    sides : pair of SideLevel
    scale_px : float
        Standard deviation of what the image is smoothed with before the edge is found, px; 0 where it is not.
    """
    if layout.looks is None:
        return False
    if layout.arrangement is None and layout.clutter is not None and layout.clutter[index]:
        return True
    moved, contrast, noise = displacement(layout, layout.looks, caliper, sides, scale_px)
    blur, length = float(np.mean(caliper.blur(caliper.positions))), float(np.ptp(caliper.positions))
    information = information_bound(np.float64(contrast), noise, blur) * length
    return not (np.isfinite(moved) and moved * np.sqrt(information) <= NEGLIGIBLE)


def displacement(
    layout: Layout, looks: Looks, caliper: Caliper, sides: tuple[SideLevel, SideLevel], scale_px: float
) -> tuple[float, float, float]:
    """How far an edge is found from where it is, at most, px, root mean square along it; contrast and noise's variance.

    An edge of contrast C and of a blur of standard deviation s, found where the image takes the mean of both sides'
    levels, moves by their mean error times sqrt(2 pi) s / C.
    """
    width = float(np.hypot(scale_px, edge_blur(np.mean(caliper.blur(caliper.positions)))))
    told, seen = np.moveaxis([_levels(layout, looks, caliper, side, width) for side in sides], 1, 0)
    contrast = float(np.abs(seen[0] - seen[1]).mean())
    error = float(np.sqrt(np.mean(np.abs(told - seen).sum(0) ** 2))) / 2
    noise = float(recorded(layout.optics.sensor, seen).noise_variance.mean())
    moved = np.sqrt(2 * np.pi) * width * error / contrast if contrast > 0 else np.inf
    return moved, contrast, noise


def _levels(
    layout: Layout, looks: Looks, caliper: Caliper, side: SideLevel, width: float
) -> tuple[np.ndarray, np.ndarray]:
    """Levels near some places of an edge, as a side's pixels tell them and as the scene has them, grey levels."""
    every = slice(None, None, -(-len(side.points) // _MOST) or 1)
    points, middle = side.points[every], caliper.positions.mean()
    shade = layout.shade(side.face, points)
    terms = _terms(side.along[every] - middle, side.across[every]) * side.terms
    found = np.linalg.lstsq(shade[:, None] * terms, looks(points), rcond=None)[0]
    along = np.repeat(np.linspace(*caliper.positions[[0, -1]], _PLACES), _NEAR.size)
    across = np.tile(side.sign * width * _NEAR, _PLACES)
    near = caliper.at(along, across)
    told = layout.shade(side.face, near) * (_terms(along - middle, across) @ found)
    return tuple(each.reshape(_PLACES, -1).mean(1) for each in (told, looks(near)))


def _terms(along: np.ndarray, across: np.ndarray) -> np.ndarray:
    return np.stack([np.ones_like(along), along, across], 1)
