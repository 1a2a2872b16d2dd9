"""A limb as an outline that a round thing is found from, beside the rims of circles (`planner.features.circles`).

The sensor's distance is known, so a surface's parameters are three (`scenes.Curved.parameters`): where it is, two of
them, and its radius. Found at another distance, the same picture would mean another radius.
"""

from __future__ import annotations

import numpy as np

from planner.features.circles import Rim
from planner.features.limb_look import LimbLook, limb_look
from planner.features.limb_outline import LIMB_POINTS, LimbOutline, clear_of_ends, limb_outline
from planner.imaging.pictures import Pictures
from scenes import Curved


def limb_rim(pictures: Pictures, curved: Curved) -> Rim:
    """Sample a limb at equal steps of its parameter; found once for each set of pictures."""
    return pictures.once(("limb", curved.name), lambda: _limb_rim(pictures, curved))


def _limb_rim(pictures: Pictures, curved: Curved) -> Rim:
    outline = limb_outline(curved, pictures.sensors, pictures.scene.camera, LIMB_POINTS)
    seen = limb_look(pictures, curved, outline)
    clear = seen.good & clear_of_ends(outline, pictures.scene)
    return rim_of(outline, seen, clear)


def rim_of(outline: LimbOutline, seen: LimbLook, clear: np.ndarray) -> Rim:
    """As a circle's rim; places that are not there have no contrast."""
    return Rim(np.nan_to_num(outline.design), np.nan_to_num(outline.arc), seen.squared, seen.noise_variance, clear)
