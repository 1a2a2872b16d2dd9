"""Images of several megapixels: many rays only where the task's edges and circles are measured from.

All fine pixels of 5 megapixels are 80 million. Here a first image of whole pixels shows where brightness steps; only
those pixels are divided. A fine pixel that an edge crosses gets all its rays where something is measured by it, and few
elsewhere. Where a single ray is random (interreflection, an aperture, a light of some size), pixels that nothing is
measured by get the rays of one fine pixel.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter

from imaging.geometry.projection import project
from render.adaptive import MISSED, crossed, limb_pieces
from scenes import Picture

LARGE = 1 << 20  # pixels of an image whose fine pixels are not all rendered
LARGE_RANDOM = 1 << 17  # the same where a single ray is random, and each fine pixel needs many
_BESIDE = 16  # rays of a fine pixel that an edge crosses which nothing is measured by


@dataclass(frozen=True, eq=False)
class Renders:
    """How parts of a crop of ``supersample`` x finer pixels are rendered.

    Attributes
    ----------
    whole : callable
        (random, rays) to the image of whole pixels, with or without the effects of random rays.
    again : callable
        (random, image of fine pixels, mask, rays) to that image with marked fine pixels rendered again.
    supersample : int
    random : bool
        Whether there are such effects.
    everywhere : bool
        Whether pixels that nothing is measured by are rendered with them, and divided.
    """

    whole: Callable[[bool, int], np.ndarray]
    again: Callable[[bool, np.ndarray, np.ndarray, int], np.ndarray]
    supersample: int
    random: bool
    everywhere: bool = True


def is_large(crop: tuple[slice, slice], supersample: int, random: bool = False) -> bool:
    """Whether an image is so large that its fine pixels are rendered only near edges.

    >>> is_large((slice(0, 2048), slice(0, 2448)), 1), is_large((slice(0, 1024), slice(0, 1024)), 4)
    (True, False)
    """
    pixels = math.prod((part.stop - part.start) // supersample for part in crop)
    return pixels > (LARGE_RANDOM if random else LARGE)


def fine_pixels(
    picture: Picture, crop: tuple[slice, slice], renders: Renders, reach: int, rays: tuple[int, int, int]
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
    rays : tuple of int
        Of an ordinary fine pixel, of one where rays are random, and of one that an edge crosses.
    """
    k, (ordinary, few, many) = renders.supersample, rays
    near = near_required(picture, crop, k)
    first = renders.whole(False, ordinary)
    divided = _fine(crossed(first, math.ceil(reach / k)) | near if renders.everywhere else near, k)
    fine = renders.again(False, _fine(first, k), divided, ordinary)
    marked, near = crossed(fine, reach) & divided, _fine(near, k)
    if renders.random:
        fine = _fine(renders.whole(True, few), k) if renders.everywhere else fine
        fine = renders.again(True, fine, near & ~marked, few)
    if renders.everywhere:
        fine = renders.again(renders.random, fine, marked & ~near, min(many, _BESIDE))
    fine = renders.again(renders.random, fine, marked & near, many)
    missed = crossed(fine, step=MISSED) & near & ~marked
    return renders.again(renders.random, fine, missed, many) if missed.any() else fine


def _fine(pixels: np.ndarray, supersample: int) -> np.ndarray:
    kind = bool if pixels.dtype == bool else np.float32  # half the memory
    return pixels.astype(kind).repeat(supersample, 0).repeat(supersample, 1)


def near_required(picture: Picture, crop: tuple[slice, slice], supersample: int) -> np.ndarray:
    """Pixels of the crop that the task's edges and circles are measured from, and their surroundings, as a mask."""
    scene, (top, left) = picture.scene, (part.start // supersample for part in crop)
    shape = tuple((part.stop - part.start) // supersample for part in crop)
    circles = {circle.name: circle.edges for circle in scene.solid.circles}
    limbs = [each for each in scene.solid.curved if each.name in scene.required]
    circles |= dict.fromkeys((each.name for each in limbs), ())
    names = [piece for name in scene.required for piece in circles.get(name, (name,))]
    ends = scene.solid.vertices[np.array([scene.solid.edge(name).ends for name in names], int).reshape(-1, 2)]
    places = np.linspace(ends[:, 0], ends[:, 1], 2 + max(shape)).reshape(-1, 3)
    places = project(places, np.array(list(picture.sensor)), scene.camera)
    pieces = [np.linspace(*ends, 2 + max(shape)) for each in limbs for ends in limb_pieces(picture, each)]
    places = np.concatenate([places, *pieces])
    x, y = places[np.isfinite(places).all(1)].T
    column, row = np.rint(x - left).astype(int), np.rint(y - top).astype(int)
    inside = (column >= 0) & (row >= 0) & (column < shape[1]) & (row < shape[0])
    found = np.zeros(shape, bool)
    found[row[inside], column[inside]] = True
    reach = scene.locator.window_px + 4 * math.hypot(scene.locator.scale_px, scene.camera.blur_px) + 1
    return maximum_filter(found, 2 * math.ceil(reach) + 1)
