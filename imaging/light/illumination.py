"""Relative illumination: how much of the light that a lens passes in the image's middle it passes elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np

from imaging.geometry.blur import height2
from imaging.geometry.projection import project
from imaging.pictures import Pictures
from scenes import Camera
from scenes.cameras.over_field import at_height, between
from scenes.materials.vectors import NUMPY, Ops

_STEP = 0.5  # px


def illumination(camera: Camera, x: Any, y: Any, ops: Ops = NUMPY) -> Any:
    """At recorded places, px, over that in the image's middle, in the arithmetic of ``ops``."""
    away2 = height2(camera, x, y)
    found = at_height(between(camera.relative_illumination), away2, ops)
    if not camera.natural_vignetting:
        return found
    corner2 = ((camera.width / 2) ** 2 + (camera.height / 2) ** 2) / camera.focal_px**2
    return found / (1 + away2 * corner2) ** 2


def fall(camera: Camera, place: np.ndarray) -> np.ndarray:
    """Gradient of its logarithm at recorded places (..., 2), 1 / px: how even things change a px."""

    found = [_at(camera, place + step) - _at(camera, place - step) for step in _STEP * np.eye(2)]
    return np.stack(found, -1) / (2 * _STEP * _at(camera, place))[..., None]


def _at(camera: Camera, place: np.ndarray) -> np.ndarray:
    return illumination(camera, place[..., 0], place[..., 1])


def dimming(pictures: Pictures, points: np.ndarray, axes: int) -> np.ndarray | float:
    """The same where points of the scene are recorded; 1 where they are not in front of the sensor.

    Parameters
    ----------
    points : ndarray, shape (..., k, 3) or (..., j, k, 3), ...
        Scene units; the pictures' leading shape, or what broadcasts to it, then so many ``axes`` of their own.
    """
    camera, sensors = pictures.scene.camera, pictures.sensors
    if not camera.is_dimmed:
        return 1.0
    poses = sensors.reshape(*sensors.shape[:-1], *(1,) * max(axes - 1, 0), 2)
    place = project(points if axes else points[..., None, :], poses, camera)
    found = np.nan_to_num(_at(camera, place), nan=1.0)
    return found if axes else found[..., 0]


def dimming_of_one(pictures: Pictures, points: np.ndarray) -> np.ndarray | float:
    """The same of points (..., 3) in one picture."""
    if not pictures.scene.camera.is_dimmed:
        return 1.0
    place = project(points.reshape(-1, 3), pictures.sensors.reshape(-1, 2)[0], pictures.scene.camera)
    return np.nan_to_num(_at(pictures.scene.camera, place), nan=1.0).reshape(points.shape[:-1])
