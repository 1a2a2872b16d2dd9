"""Poses are set with a ruler: sensor and light stand a little beside where they should."""

from __future__ import annotations

import numpy as np

from planner import variances
from planner.view import project
from render.effects.base import SAFETY, Effect, Influence, Poses, changed
from scenes import Pose, Scene


class PoseJitter(Effect):
    """Each picture is taken from a pose that is off by a random angle."""

    name = "pose_jitter"
    cost = 1000.0
    switch = "each picture is rendered from its own pose (render.shaken)"

    def absent(self, scene: Scene, poses: Poses) -> str | None:
        return "poses are exact" if scene.jitter.sensor_deg == 0 and scene.jitter.light_deg == 0 else None

    def influence(self, scene: Scene, poses: Poses) -> Influence:
        """By how much the projected distance changes with the sensor's pose; the light only changes contrasts.

        First order in the angles for the variance, second order for the mean.
        """
        step = max(scene.jitter.sensor_deg, 1e-3)
        here = _distance(scene, poses.sensors)
        spread, bend = np.zeros(len(here)), np.zeros(len(here))
        for axis in np.eye(2):
            scale = np.where(axis[1], 1 / np.maximum(np.sin(np.radians(poses.sensors[:, 0])), 1e-2), 1.0)[:, None]
            ahead, behind = (_distance(scene, poses.sensors + sign * step * scale * axis) for sign in (1, -1))
            spread += ((ahead - behind) / 2 / step * scene.jitter.sensor_deg) ** 2
            bend += np.abs(ahead - 2 * here + behind) / 2 / step**2 * scene.jitter.sensor_deg**2
        own = variances(scene, poses.sensors, poses.lights)
        tilt = np.radians(scene.jitter.light_deg)
        contrast = 6 * tilt**2  # the mean of 1 / cos^2 over small tilts
        return Influence(SAFETY * float(bend.max()), SAFETY * float(np.max(spread / own) + contrast))

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "jitter", sensor_deg=0.0, light_deg=0.0)


def shaken(scene: Scene, role: str, pose: Pose, rng: np.random.Generator) -> Pose:
    """A pose as it is set in practice: off by normal angles of `scenes.Jitter` along both directions of its sphere."""
    sigma = scene.jitter.sensor_deg if role == "sensor" else scene.jitter.light_deg
    away, around = sigma * rng.standard_normal(2)
    polar = pose.polar_deg + away
    turn = around / max(np.sin(np.radians(pose.polar_deg)), 1e-2)
    return Pose(abs(polar), pose.azimuth_deg + turn + (180.0 if polar < 0 else 0.0))


def _distance(scene: Scene, sensors: np.ndarray) -> np.ndarray:
    ends = np.array([scene.solid.vertex(corner.vertex) for corner in scene.task.corners])
    image = project(ends, sensors, scene.camera)
    return np.linalg.norm(image[:, 1] - image[:, 0], axis=-1)
