"""Poses are set with a ruler: sensor and light stand a little beside where they should."""

from __future__ import annotations

import numpy as np

from imaging.models import DEFAULT_MODEL, variance_model
from imaging.pictures import Pictures
from imaging.pose_scatter import LEAST_SINE, pose_scatter
from render.phenomena.base import SAFETY, Effect, Influence, changed
from scenes import Pose, Scene


class PoseJitter(Effect):
    """Each picture is taken from a pose that is off by a random angle."""

    name = "pose_jitter"
    cost = 1000.0
    switch = "each picture is rendered from its own pose (render.shots)"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        return "poses are exact" if scene.jitter.sensor_deg == 0 and scene.jitter.light_deg == 0 else None

    def influence(self, pictures: Pictures) -> Influence:
        """By how much the projected values change with the sensor's pose; the light only changes contrasts."""
        scene = pictures.scene
        spread = pose_scatter(scene, pictures.sensors)
        own = variance_model(DEFAULT_MODEL)(pictures).variances
        contrast = 6 * np.radians(scene.jitter.light_deg) ** 2  # the mean of 1 / cos^2 over small tilts
        share = float(np.max(np.einsum("smm->sm", spread.covariance) / own) + contrast)
        return Influence(SAFETY * float(spread.bias.max()), SAFETY * share)

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "jitter", sensor_deg=0.0, light_deg=0.0)


def shaken(scene: Scene, role: str, pose: Pose, rng: np.random.Generator) -> Pose:
    """A pose as it is set in practice: off by normal angles of `scenes.Jitter` along both directions of its sphere."""
    sigma = scene.jitter.sensor_deg if role == "sensor" else scene.jitter.light_deg
    away, around = sigma * rng.standard_normal(2)
    polar = pose.polar_deg + away
    turn = around / max(np.sin(np.radians(pose.polar_deg)), LEAST_SINE)
    beyond = not 0 <= polar <= 180  # a pole: on its other side
    return Pose(min(abs(polar), 360.0 - polar), pose.azimuth_deg + turn + (180.0 if beyond else 0.0))
