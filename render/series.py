"""Pictures of a scene, each from a pose of its own: what the ruler adds to the sensor's noise."""

from __future__ import annotations

from typing import Any

import numpy as np

from render.phenomena.pose import shaken
from render.renderer import image
from render.sensor import expose
from scenes import Pose, Scene


def shots(scene: Scene, sensor: Pose, light: Pose, rng: np.random.Generator, count: int, **how: Any) -> np.ndarray:
    """Take ``count`` pictures, sensor and light set anew for each, as exactly as `scenes.Jitter` says.

    Parameters are those of `render.image` (``how``: quality, variant, effects, tolerance) and `render.expose`.

    Returns
    -------
    ndarray of float64, shape (count, height, width)
        Grey levels.
    """
    taken = []
    for _ in range(count):
        poses = shaken(scene, "sensor", sensor, rng), shaken(scene, "light", light, rng)
        taken.append(expose(image(scene, *poses, **how), scene.noise, rng, 1)[0])
    return np.array(taken)
