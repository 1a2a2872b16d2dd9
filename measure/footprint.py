"""Which pixels a measurement looks at, so that no other pixel's noise need be drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation

from measure.canny import CannyLocator
from measure.distance import prepare
from measure.gradient import GradientLocator
from scenes import Scene


def footprint(scene: Scene, sensor: Any, locators: tuple[str, ...] = ("gradient", "canny")) -> np.ndarray:
    """Pixels that can change the measured distance.

    Parameters
    ----------
    scene, sensor
        As for `measure.distance`.
    locators : tuple of str

    Returns
    -------
    ndarray of bool, shape (height, width)
    """
    used = np.zeros((scene.camera.height, scene.camera.width), bool)
    for locator in locators:
        for _, edge in prepare(scene, scene.check_pose("sensor", sensor), locator, None):
            if isinstance(edge, GradientLocator):
                used.flat[edge.pixels] = True
            elif isinstance(edge, CannyLocator):
                radius = len(edge.smooth) // 2 + 2  # kernel, and the neighbours that thinning and parabola look at
                around = binary_dilation(np.pad(edge.near, radius), np.ones((2 * radius + 1,) * 2))
                inner = around[radius:-radius, radius:-radius]
                used[edge.rows, edge.columns] |= inner
    return used
