"""Many rays only where an edge crosses: fine pixels that differ from a neighbour are rendered again."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from imaging.features.limb_outline import limb_outline
from imaging.features.projected_edges import circles, projected_edges
from imaging.features.rim_sides import RIM_POINTS
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import project
from imaging.pictures import Pictures
from render.rays import Rays
from scenes import Curved, Picture

MISSED = 0.25  # of the brightest: so far is a fine pixel whose one ray missed the tip of a corner from a refined one
STEP = 0.01  # part of the brightest pixel that a neighbour must differ by; shading varies by less over a fine pixel


def crossed(fine: np.ndarray, reach: int = 0, step: float = STEP, where: np.ndarray | None = None) -> np.ndarray:
    """Fine pixels that differ from one of their eight neighbours, as a mask; with others within ``reach`` of them.

    ``step`` is the part of the brightest pixel that they must differ by. Only pixels of the mask ``where`` are asked,
    all if it is not given.

    >>> crossed(np.array([[0.0, 0, 0, 1, 1, 1]])).astype(int)
    array([[0, 0, 1, 1, 0, 0]])
    """
    least = step * max(float(fine.max()), np.finfo(float).tiny)
    if where is None:
        marked = maximum_filter(fine, 3, mode="nearest") - minimum_filter(fine, 3, mode="nearest") > least
    else:
        marked = np.zeros(fine.shape, bool)
        marked[where] = _span(fine, where) > least
    return maximum_filter(marked, 2 * reach + 1) if reach else marked


def _span(fine: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Largest less smallest of each marked pixel and its eight neighbours."""
    wide = np.pad(fine, 1, mode="edge")
    rows, columns = np.nonzero(where)
    width, flat = wide.shape[1], wide.ravel()
    at = (rows + 1) * width + columns + 1
    low = high = flat[at]
    for off in (-width - 1, -width, -width + 1, -1, 1, width - 1, width, width + 1):
        beside = flat[at + off]
        low, high = np.minimum(low, beside), np.maximum(high, beside)
    return high - low


def bent(fine: np.ndarray, step: float = STEP) -> np.ndarray:
    """Fine pixels at which, or beside which, brightness does not run on evenly, as a mask: not those of a slope alone.

    >>> bent(np.array([[0.0, 1, 2, 3, 4, 60, 60, 60, 60]]), 0.1).astype(int)
    array([[0, 0, 0, 1, 1, 1, 1, 0, 0]])
    """
    wide = np.pad(fine, 1, mode="reflect", reflect_type="odd") if min(fine.shape) > 1 else np.pad(fine, 1, mode="edge")
    rows, columns = fine.shape

    def beside(y: int, x: int) -> np.ndarray:
        return wide[1 + y : 1 + y + rows, 1 + x : 1 + x + columns]

    ways = (0, 1), (1, 0), (1, 1), (1, -1)
    bend = np.max([np.abs(beside(y, x) + beside(-y, -x) - 2 * fine) for y, x in ways], axis=0)
    return maximum_filter(bend > step * max(float(fine.max()), np.finfo(float).tiny), 3)


def near_edges(picture: Picture, crop: tuple[slice, slice], supersample: int) -> np.ndarray:
    """Fine pixels of the crop that edges and circles are located from, and their surroundings, as a mask."""
    locator, shape = picture.scene.locator, [(part.stop - part.start) // supersample for part in crop]
    rows, columns = (part.start // supersample + np.arange(n) for part, n in zip(crop, shape, strict=True))
    pixels = np.stack(np.meshgrid(columns, rows), -1).astype(float)
    found = np.zeros(shape, bool)
    for start, stop in [*projected_edges(Pictures.of(picture)).recorded, *_around(picture)]:
        along = stop - start
        part = np.clip((pixels - start) @ along / max(along @ along, np.finfo(float).tiny), 0, 1)
        away = np.linalg.norm(pixels - start - part[..., None] * along, axis=-1)
        found |= away <= locator.window_px + 4 * locator.scale_px + 1
    return found.repeat(supersample, 0).repeat(supersample, 1)


def _around(picture: Picture) -> list[np.ndarray]:
    """Pieces of the images of the required circles and limbs, (2, 2) each, px."""
    pieces = []
    for name in circles(picture.scene):
        circle = picture.scene.solid.round(name)
        if isinstance(circle, Curved):
            pieces += limb_pieces(picture, circle)
            continue
        places = circle.at(circle.angles(RIM_POINTS))
        rim = project(places, np.array(list(picture.sensor)), picture.scene.camera)
        whole = np.stack([rim, np.roll(rim, -1, 0)], 1)
        pieces += list(whole if circle.ends is None else whole[:-1])
    return pieces


def limb_pieces(picture: Picture, curved: Curved) -> list[np.ndarray]:
    """Pieces of a limb's image, (2, 2) each, px."""
    outline = limb_outline(curved, np.array(list(picture.sensor)), picture.scene.camera)
    at = outline.at + image_centre(picture.scene.camera)
    pieces = np.stack([at, np.roll(at, -1, 0)], 1)
    return list(pieces[np.isfinite(pieces).all((1, 2))])


def refine(scene: Any, rays: Rays, fine: np.ndarray, marked: np.ndarray, samples: int) -> np.ndarray:
    """The image with its marked fine pixels rendered again, ``samples`` (a square number) stratified rays each.

    Parameters
    ----------
    scene : mitsuba.Scene
        Of a compiled variant, which traces all rays as one array.
    rays : Rays
    fine : ndarray
        The image as rendered so far.
    marked : ndarray of bool
    samples : int
    """
    result, places = fine.copy(), np.nonzero(marked)
    result[places] = rays.radiance(scene, *places, fine.shape, samples)
    return result
