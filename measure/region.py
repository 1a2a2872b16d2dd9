"""Which pixels a measurement looks at, so that no other pixel's noise need be drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from imaging.features.projected_edges import circles
from measure.features.board import board_pixels
from measure.features.layout import layout_of
from measure.features.rims import rim_tool, unmoved
from measure.features.shape import prepared
from measure.measurement import check_method
from scenes import InvalidInput, Picture, Scene
from scenes.errors import given


def region_of_interest(
    scene: Scene | Picture, sensor: Any = None, light: Any = None, estimators: tuple[str, ...] = ("gradient", "canny")
) -> np.ndarray:
    """Pixels that can change a measured value, as long as edges and circles are where the pose projects them.

    Parameters
    ----------
    scene, sensor, light
        As for `measure.distance`.
    estimators : tuple of str

    Returns
    -------
    ndarray of bool, shape (height, width)
    """
    picture = Picture.of(scene, sensor, light)
    if not isinstance(estimators, tuple | list):
        raise InvalidInput(f"estimators must be a tuple of names, got {given(estimators)}")
    for name in estimators:
        check_method(name, None)
    layout = layout_of(picture)
    used = board_pixels(picture)
    for name in circles(picture.scene):
        used.flat[rim_tool(picture, name, unmoved(picture, name)).locator.pixels] = True
    for name in estimators if layout.names else ():
        used.flat[prepared(layout, name, picture.scene.locator.thresholds[0]).pixels] = True
    return used
