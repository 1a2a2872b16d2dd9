"""Images of several megapixels, or of random rays: many only where the task's edges and circles are measured from.

All fine pixels of 5 megapixels are 80 million, and where a single ray is random (interreflection, an aperture, a light
of some size) each needs many. Here a first image of whole pixels shows where brightness steps; only those pixels are
divided; if only what is measured is to be seen, pixels that nothing is measured by stay dark. A fine pixel that an edge
crosses gets all its rays where something is measured by it, and few elsewhere. Where rays are random, pixels that
nothing is measured by get those of one fine pixel. What plane faces send to each other is even over a pixel that no
edge crosses: such pixels are rendered as a whole (`render.even`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from render.adaptive import MISSED, crossed, dilated
from render.even import Even, Zones, fine_of, with_light_between
from render.surroundings import near_required
from scenes import Picture

LARGE = 1 << 20  # pixels of an image whose fine pixels are not all rendered
LARGE_RANDOM = 1 << 17  # the same of random rays, of which each pixel then gets fewer
_MOVING = 3.0  # standard deviations of scale and blur together: noise of pixels farther from an edge does not move it
_FEWER = 2  # times fewer rays there, each way
_PILOT, _AROUND = 4, 2  # rays that tell whether surfaces send light to a pixel, and pixels around of which they tell
_BESIDE = 16  # rays of a fine pixel that an edge crosses which nothing is measured by


@dataclass(frozen=True, eq=False)
class Renders:
    """How parts of a crop of ``supersample`` x finer pixels are rendered.

    Attributes
    ----------
    whole : callable
        (random, rays) to the image of whole pixels, with or without the effects of random rays; with a mask, 0 beside
        it.
    again : callable
        (random, image of fine pixels, mask, rays) to that image with marked fine pixels rendered again.
    supersample : int
    random : bool
        Whether there are such effects.
    everywhere : bool
        Whether pixels that nothing is measured by are rendered, too; else they are dark.
    bounced : callable, optional
        (mask of whole pixels, mask of those whose noise moves an edge, rays) to the image of fine pixels of what
        surfaces send to each other, 0 elsewhere: where that alone is random and is to be added to the direct light.
    even : Even, optional
        Where what is random is light that plane faces send to each other.
    alike : bool
        Whether pixels get the same rays wherever an edge crosses them, so that those of two images from one place are
        the same one by one: where they are random, rays go by their order.
    """

    whole: Callable[..., np.ndarray]
    again: Callable[[bool, np.ndarray, np.ndarray, int], np.ndarray]
    supersample: int
    random: bool
    everywhere: bool = True
    bounced: Callable[[np.ndarray, np.ndarray, int], np.ndarray] | None = None
    even: Even | None = None
    alike: bool = False


class Counts(NamedTuple):
    """Rays of a fine pixel: an ordinary one, and where rays are random one that nothing is measured from, one that
    something is; one that an edge crosses."""

    ordinary: int
    few: int
    near: int
    many: int


def whole_pixels(crop: tuple[slice, slice], supersample: int) -> tuple[slice, slice]:
    """A crop of fine pixels, in pixels."""
    rows, columns = (slice(part.start // supersample, part.stop // supersample) for part in crop)
    return rows, columns


def is_large(crop: tuple[slice, slice], supersample: int, random: bool = False) -> bool:
    """Whether an image is so large that its fine pixels are rendered only near edges.

    >>> is_large((slice(0, 2048), slice(0, 2448)), 1), is_large((slice(0, 1024), slice(0, 1024)), 4)
    (True, False)
    """
    pixels = math.prod((part.stop - part.start) // supersample for part in crop)
    return pixels > (LARGE_RANDOM if random else LARGE)


def fine_pixels(
    picture: Picture, crop: tuple[slice, slice], renders: Renders, reach: int, counts: Counts
) -> np.ndarray:
    """Image of the crop's fine pixels.

    Parameters
    ----------
    picture : Picture
    crop : tuple of slice
        Rows and columns of fine pixels.
    renders : Renders
    reach : int
        Radius of the largest circle of confusion, fine pixels.
    counts : Counts
    """
    k, (ordinary, few, close_by, many) = renders.supersample, counts
    near = near_required(picture, crop, k)
    if renders.bounced is not None:
        direct = fine_pixels(picture, crop, replace(renders, random=False, bounced=None), reach, counts)
        moving = near_required(picture, crop, k, _MOVING)
        if renders.everywhere:
            near, moving = np.ones_like(near), np.ones_like(moving)
        if renders.even is not None:
            near = renders.even.lent_to(near)
        return direct + renders.bounced(near, moving, few)
    if renders.everywhere:
        first = renders.whole(False, ordinary)
        fine, divided, asked = fine_of(first, k), fine_of(crossed(first, math.ceil(reach / k)) | near, k), None
    else:
        first, fine = np.zeros(near.shape), np.zeros([k * size for size in near.shape], np.float32)
        divided, asked = fine_of(near, k), fine_of(~dilated(~near, 3), k)  # beside what is dark there is a step
    fine = renders.again(False, fine, divided, ordinary)
    marked, close, lent = crossed(fine, reach, where=asked), fine_of(near, k) if renders.everywhere else divided, None
    marked &= divided
    if renders.random and renders.even is not None:
        seen = renders.even.lent_to(np.ones_like(near) if renders.everywhere else near)
        lent = fine_of(seen, k)
    if renders.random and renders.alike and not renders.everywhere:
        return renders.again(True, fine, close if lent is None else close & lent, max(few, many))
    if renders.random and renders.even is not None:
        moving = near if close_by > few else near_required(picture, crop, k, _MOVING)
        fine = with_light_between(renders, renders.even, first, fine, Zones(seen, near, moving), marked, counts)
    elif renders.random:
        fine = fine_of(renders.whole(True, close_by), k) if renders.everywhere else fine
        plain, moving = close & ~marked, True
        if is_large(crop, k, random=True):  # else few rays at all would tell the variances badly
            moving = fine_of(near_required(picture, crop, k, _MOVING), k)
        fine = _with_random(renders, fine, plain & moving, plain & ~np.asarray(moving), close_by)
    return _at_edges(renders, fine, marked, close, lent, many)


def _at_edges(
    renders: Renders, fine: np.ndarray, marked: np.ndarray, close: np.ndarray, lent: np.ndarray | None, many: int
) -> np.ndarray:
    """The image with its marked fine pixels, which an edge crosses, and then those beside them that turn out to be
    crossed, too, by many rays where they are close to what is measured."""
    parts = [(marked & ~close, min(many, _BESIDE)), (marked & close, many)] if renders.everywhere else [(marked, many)]
    for where, count in parts:
        for random, some in _by_light(where, lent) if renders.random else [(False, where)]:
            fine = renders.again(random, fine, some, count) if some.any() else fine
    beside = dilated(marked, 3)  # elsewhere it is noise
    beside &= close
    missed = crossed(fine, step=MISSED, where=np.greater(beside, marked, out=beside))
    return renders.again(renders.random, fine, missed, many) if missed.any() else fine


def _by_light(where: np.ndarray, lent: np.ndarray | None) -> list[tuple[bool, np.ndarray]]:
    """Whether light takes random ways to some pixels, and which these are: to all where ``lent`` does not tell."""
    return [(True, where)] if lent is None else [(False, where & ~lent), (True, where & lent)]


def bounced(
    made: Callable[[np.ndarray, int], np.ndarray], near: np.ndarray, moving: np.ndarray, rays: int
) -> np.ndarray:
    """What surfaces send to each other, image of whole pixels: ``rays`` where there is any and it moves an edge.

    ``made`` takes a mask of whole pixels and rays.
    """
    light = made(near, _PILOT)
    lit = dilated(light > 0, 2 * _AROUND + 1) & near & moving
    return np.where(lit, made(lit, rays), light)


def _with_random(renders: Renders, fine: np.ndarray, moving: np.ndarray, still: np.ndarray, rays: int) -> np.ndarray:
    """The image with fine pixels that no edge crosses; fewer rays of those whose noise moves no edge."""
    fine = renders.again(True, fine, moving, rays)
    return renders.again(True, fine, still, max(math.isqrt(rays) // _FEWER, 1) ** 2) if still.any() else fine
