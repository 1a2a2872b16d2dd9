"""Pictures of a scene, each from a pose of its own: what the ruler adds to the sensor's noise."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from render.phenomena import Tolerance
from render.phenomena.pose import shaken
from render.quality import Quality
from render.renderer import image
from render.sensor import expose
from scenes import Pose, Scene


def shots(
    scene: Scene,
    sensor: Pose,
    light: Pose,
    rng: np.random.Generator,
    count: int,
    quality: Quality = Quality(),
    variant: str | None = None,
    effects: str | Iterable[str] = "auto",
    tolerance: Tolerance = Tolerance(),
) -> np.ndarray:
    """Take ``count`` pictures, sensor and light set anew for each, as exactly as `scenes.Jitter` says.

    Parameters are those of `render.image` and `render.expose`.

    Returns
    -------
    ndarray of float64, shape (count, height, width)
        Grey levels.
    """
    taken = []
    for _ in range(count):
        poses = shaken(scene, "sensor", sensor, rng), shaken(scene, "light", light, rng)
        clean = image(scene, *poses, quality, variant, effects, tolerance)
        taken.append(expose(clean, scene.noise, rng, 1)[0])
    return np.array(taken)
