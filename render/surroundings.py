"""Surroundings of what is measured, as masks: which pixels edges, circles and limbs are located from."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.ndimage import maximum_filter

from imaging.features.limb_outline import limb_outline
from imaging.geometry.lens import image_centre
from imaging.geometry.measured import measured_pieces
from imaging.geometry.projection import project, project_ideal
from scenes import Curved, Picture


def near_required(
    picture: Picture, crop: tuple[slice, slice], supersample: int, within: float | None = None
) -> np.ndarray:
    """Pixels of the crop that the task's edges and circles are measured from, and their surroundings, as a mask; or
    those ``within`` so many standard deviations of scale and blur together of where they are. Not to be changed."""
    corner = tuple(part.start // supersample for part in crop)
    shape = tuple((part.stop - part.start) // supersample for part in crop)
    return _near_required(picture.unlit(), corner, shape, within)


@lru_cache(maxsize=4)
def _near_required(
    picture: Picture, corner: tuple[int, int], shape: tuple[int, int], within: float | None
) -> np.ndarray:
    """The same of a crop of whole pixels: all lights and rays share it."""
    scene, (top, left) = picture.scene, corner
    limbs = [each for each in scene.solid.curved if each.name in scene.required]
    ends = measured_pieces(scene)
    places = np.linspace(ends[:, 0], ends[:, 1], 2 + max(shape)).reshape(-1, 3)
    sensor = np.array(list(picture.sensor))
    seen = (project, project_ideal) if scene.camera.lens.bends else (project,)  # rendered by a pinhole, bent after
    places = np.concatenate([made(places, sensor, scene.camera) for made in seen])
    pieces = [np.linspace(*ends, 2 + max(shape)) for each in limbs for ends in _limb(picture, each)]
    places = np.concatenate([places, *pieces])
    x, y = places[np.isfinite(places).all(1)].T
    column, row = np.rint(x - left).astype(int), np.rint(y - top).astype(int)
    inside = (column >= 0) & (row >= 0) & (column < shape[1]) & (row < shape[0])
    found = np.zeros(shape, bool)
    found[row[inside], column[inside]] = True
    spread = math.hypot(scene.locator.scale_px, scene.camera.most_blur_px)
    reach = 1 + (scene.locator.window_px + 4 * spread if within is None else within * spread)
    near = maximum_filter(found, 2 * math.ceil(reach) + 1)
    near.flags.writeable = False
    return near


def _limb(picture: Picture, curved: Curved) -> list[np.ndarray]:
    """Pieces of a limb's image, (2, 2) each, px."""
    outline = limb_outline(curved, np.array(list(picture.sensor)), picture.scene.camera)
    at = outline.at + image_centre(picture.scene.camera)
    pieces = np.stack([at, np.roll(at, -1, 0)], 1)
    return list(pieces[np.isfinite(pieces).all((1, 2))])
