"""What it costs to set the sensor's pose with a ruler: the distance in the image changes with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.imaging.projection import project_ideal
from scenes import Scene

LEAST_SINE = 1e-2  # beside the pole a step along the circle of latitude would turn the azimuth without end


class PoseSpread(NamedTuple):
    """Variance (px^2, first order) and bias (px, at most; second order) of the distance, shape (S,) each."""

    variance: np.ndarray
    bias: np.ndarray


def pose_spread(scene: Scene, sensors: np.ndarray) -> PoseSpread:
    """Spread of the projected distance over poses that are off as `scenes.Jitter` says.

    The light's pose changes contrasts alone, which is left out.

    Parameters
    ----------
    scene : Scene
        With a task between two corners.
    sensors : ndarray, shape (S, 2)
        Polar angles and azimuths, degrees.

    Examples
    --------
    >>> import scenes
    >>> scene = scenes.load("task1").model_copy(update={"jitter": scenes.Jitter(sensor_deg=0.1)})
    >>> pose_spread(scene, np.array([[30.0, 135.0]])).variance.round(4)
    array([0.0137])
    """
    sigma = scene.jitter.sensor_deg
    if sigma == 0:
        return PoseSpread(np.zeros(len(sensors)), np.zeros(len(sensors)))
    step = max(sigma, 1e-3)
    here = _distance(scene, sensors)
    variance, bias = np.zeros(len(here)), np.zeros(len(here))
    sine = np.maximum(np.sin(np.radians(sensors[:, 0])), LEAST_SINE)
    for axis in (np.stack([np.ones_like(sine), 0 * sine], -1), np.stack([0 * sine, 1 / sine], -1)):
        ahead, behind = (_distance(scene, sensors + sign * step * axis) for sign in (1, -1))
        variance += ((ahead - behind) / 2 * (sigma / step)) ** 2
        bias += np.abs(ahead - 2 * here + behind) / 2 * (sigma / step) ** 2
    return PoseSpread(variance, bias)


def _distance(scene: Scene, sensors: np.ndarray) -> np.ndarray:
    ends = np.array([scene.solid.vertex(corner.vertex) for corner in scene.task.corners])
    image = project_ideal(ends, sensors, scene.camera)
    return np.linalg.norm(image[:, 1] - image[:, 0], axis=-1)
