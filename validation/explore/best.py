"""From a state down to the next place from which its measurand is known best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.search.constraints import Constraints, same_side
from planner.search.grid import by_light
from planner.search.local import Start, descend
from scenes import InvalidInput, Pose, Scene
from validation.explore.state import State

_STEP_DEG = 10.0


def best_from(scene: Scene, state: State) -> State:
    """Sensor and all free lights moved to the next local minimum of the measurand's variance in the object.

    Bodies of camera and lamps keep clear of each other, each on its side of the part; rims of circles are glanced at.

    Raises
    ------
    InvalidInput
        If it cannot be measured from the state, or a pose is refused.
    """
    state.picture(scene)
    sensor = np.array(list(state.sensor))
    lights = np.array([list(pose) for pose in state.lights]).reshape(-1)

    limits = Constraints(same_side([state.sensor]), same_side(state.lights))

    def variance(sensor: np.ndarray, lights: np.ndarray, _: np.ndarray | None = None) -> float:
        if not limits.allows(scene, sensor, lights):
            return np.inf
        given = by_light(lights[None])
        pictures = Pictures.of(scene, sensor[None], given if scene.free else None)
        return float(variance_model("calibrated")(pictures).variances_object.reshape(-1)[state.measurand])

    if not np.isfinite(variance(sensor, lights)):
        raise InvalidInput("the descent must begin where the measurand can be measured and bodies are clear")
    sensor, lights, *_ = descend(Start(sensor, lights, unit_deg=_STEP_DEG), variance, sizes=(0.7, 0.1))
    poses = [Pose(*map(float, pose.round(2))) for pose in (sensor, *lights.reshape(-1, 2))]
    return replace(state, sensor=poses[0], lights=tuple(poses[1:]))
