"""A limb as an outline that a round thing is found from, beside the rims of circles (`imaging.features.circles`).

The sensor's distance is known, so a surface's parameters are three (`scenes.Curved.parameters`): where it is, two of
them, and its radius; of a cone its half angle, too. Found at another distance, the same picture would mean another
radius.
"""

from __future__ import annotations

import numpy as np

from imaging.features.circles import RimImage
from imaging.features.limb_look import LimbLook, clear_of_others, limb_look
from imaging.features.limb_outline import LIMB_POINTS, LimbOutline, limb_outline
from imaging.geometry.blur import blur_at
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import depth
from imaging.pictures import Pictures
from scenes import Curved


def limb_rim(pictures: Pictures, curved: Curved) -> RimImage:
    """Sample a limb at equal steps of its parameter; found once for each set of pictures."""
    return pictures.once(("limb", curved.name), lambda: _limb_rim(pictures, curved))


def _limb_rim(pictures: Pictures, curved: Curved) -> RimImage:
    outline = limb_outline(curved, pictures.sensors, pictures.scene.camera, LIMB_POINTS)
    seen = limb_look(pictures, curved, outline)
    clear = seen.good & clear_of_others(pictures, curved, outline, seen)
    camera = pictures.scene.camera
    away = depth(np.where(outline.seen[..., None], outline.points, curved.centre), pictures.sensors, camera)
    place = np.nan_to_num(outline.at) + image_centre(camera)
    return rim_of(outline, seen, clear, place, blur_at(camera, away, place))


def rim_of(
    outline: LimbOutline, seen: LimbLook, clear: np.ndarray, place: np.ndarray, blur: np.ndarray | float = 0.0
) -> RimImage:
    """As a circle's rim; places that are not there have no contrast."""
    design, arc = np.nan_to_num(outline.design), np.nan_to_num(outline.arc)
    normal = np.nan_to_num(outline.outward)
    return RimImage(design, arc, seen.squared, seen.noise_variance, clear, blur=blur, place=place, normal=normal)
