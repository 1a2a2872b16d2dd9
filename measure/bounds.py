"""The Cramer-Rao bound: what no unbiased estimator of the distance can beat."""

from __future__ import annotations

from typing import Any

from imaging.models.bound import bound as errors_at_the_bound
from imaging.pictures import Pictures
from scenes import InvalidInput, Picture, Scene


def bound(scene: Scene | Picture, sensor: Any = None, light: Any = None) -> float:
    """Smallest variance of the distance that any unbiased estimator can have in this setting, px^2.

    From the model of the whole picture around the required edges: free are all vertices there, the levels of
    the faces and the background. Infinite where an edge cannot be seen.

    Examples
    --------
    >>> import scenes
    >>> 4e-5 < bound(scenes.load("task1"), (30, 135), (15, 315)) < 6e-5
    True
    """
    picture = Picture.of(scene, sensor, light)
    if not picture.lights:
        raise InvalidInput("light must be a pose, got nothing")
    kind = picture.scene.quantities[0].kind
    if kind != "distance":
        raise InvalidInput(f"task.kind must be distance for a bound in px^2, got {kind!r}")
    return float(errors_at_the_bound(Pictures.of(picture)).variances[0])
