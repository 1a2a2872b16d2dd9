"""The Cramer-Rao bound of the measured distance."""

from __future__ import annotations

from typing import Any

from planner import predict
from scenes import Scene


def bound(scene: Scene, sensor: Any, light: Any) -> float:
    """Smallest variance of the distance that any unbiased estimator can have in this setting, px^2.

    From the closed form: information C^2 / (2 sqrt(pi) s_e s_n^2) on the offset per px of edge, with the contrast C
    along each edge as the planner predicts it. Infinite where an edge cannot be seen.

    Examples
    --------
    >>> import scenes
    >>> 4e-5 < bound(scenes.load("task1"), (30, 135), (15, 315)) < 6e-5
    True
    """
    return predict(scene, sensor, light, price="bound").variance_px2
