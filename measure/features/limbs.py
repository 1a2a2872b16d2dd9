"""What measures a curved surface by its limb: places along it, a locator there, and the least squares of three numbers.

Where the light is known the shift by the shading, which is no step, is taken off; else a limb beside darkness is
measured as `clutter`, for nobody knows how its level falls.
"""

from __future__ import annotations

import numpy as np

from imaging.features.circles import LEAST_CLEAR, LEAST_SEEN
from imaging.features.limb_look import LimbLook, clear_of_others, limb_look, seen_along
from imaging.features.limb_outline import LimbOutline, clear_of_ends, limb_outline, limb_places
from imaging.features.locator import MIN_CONTRAST, edge_blur
from imaging.geometry.lens import image_centre
from imaging.pictures import Pictures
from measure.estimators.gradient import gradient_along
from measure.features.optics import Optics
from measure.features.tools import RimTool, held
from scenes import Curved, Picture, status


def limb_tool(picture: Picture, nominal: Curved, moved: tuple[float, ...]) -> RimTool:
    """What measures a curved surface, expected with errors of its three parameters."""
    scene, pictures = picture.scene, Pictures.of(picture)
    optics, curved = Optics.of(scene), nominal.moved(pictures.viewpoint, moved)
    count = limb_places(limb_outline(nominal, pictures.sensors, scene.camera), optics.scale_px)
    outline = limb_outline(curved, pictures.sensors, scene.camera, count)
    seen = limb_look(pictures, curved, outline) if pictures.lights else None
    weight, state = _weights(pictures, curved, outline, seen)
    blur = optics.blur_at(np.nan_to_num(outline.at) + image_centre(scene.camera))
    width = np.hypot(optics.scale_px, edge_blur(blur))
    inward = np.nan_to_num(outline.curvature) * width**2 / 2 if seen is None else -seen.shift
    keep = np.flatnonzero(weight > 0) if (weight > 0).any() else np.arange(1)
    normals = np.where(outline.seen[:, None], outline.outward, [1.0, 0.0])
    crossings = np.nan_to_num(outline.at) - inward[:, None] * normals  # a pixel may lie between
    places, none = held(crossings + image_centre(scene.camera), optics), np.zeros(len(keep))
    locator = gradient_along(optics, np.arange(float(len(weight)))[keep], places[keep], normals[keep])
    design = np.nan_to_num(outline.design)[keep]
    return RimTool(design, weight[keep], none, state, optics, locator=locator, places=places[keep])


def _weights(pictures: Pictures, curved: Curved, outline: LimbOutline, seen: LimbLook | None) -> tuple[np.ndarray, str]:
    """Weights of places (n,), 0 where they are not taken, and the status that this makes; rules as of circles."""
    shown, arc = seen_along(pictures, curved, outline), np.nan_to_num(outline.arc)
    if shown.sum() < LEAST_SEEN * shown.size:
        return np.zeros(shown.size), status.NOT_VISIBLE
    if seen is None:
        return np.where(shown & clear_of_ends(outline, pictures.scene), arc, 0.0), status.CLUTTER
    clear = clear_of_others(pictures, curved, outline, seen)
    strong = shown & (seen.squared >= MIN_CONTRAST**2 * seen.noise_variance)
    if strong.mean() < LEAST_SEEN:
        return np.zeros(shown.size), status.LOW_CONTRAST
    weight, good = arc * seen.squared / seen.noise_variance, strong & seen.good & clear
    if good.mean() < max(LEAST_CLEAR * max(strong.mean(), LEAST_CLEAR), LEAST_SEEN):
        return np.where(strong, weight, 0.0), status.CLUTTER
    return np.where(good, weight, 0.0), status.OK
