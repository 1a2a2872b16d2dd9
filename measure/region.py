"""Which pixels a measurement looks at, so that no other pixel's noise need be drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from measure.features.layout import layout_of
from measure.features.shape import prepared
from scenes import Scene


def region_of_interest(
    scene: Scene, sensor: Any, light: Any = None, estimators: tuple[str, ...] = ("gradient", "canny")
) -> np.ndarray:
    """Pixels that can change the measured distance, as long as the edges are where the pose projects them.

    Parameters
    ----------
    scene, sensor, light
        As for `measure.distance`.
    estimators : tuple of str

    Returns
    -------
    ndarray of bool, shape (height, width)
    """
    light = None if light is None else scene.check_pose("light", light)
    layout = layout_of(scene, scene.check_pose("sensor", sensor), light)
    used = np.zeros(layout.optics.shape, bool)
    for name in estimators:
        used.flat[prepared(layout, name, scene.locator.thresholds[0]).pixels] = True
    return used
