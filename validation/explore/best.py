"""From a state down to the next place from which its measurand is known best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.constraints import Constraints, same_side
from planner.search.local import refine
from planner.search.objective import Aim, SearchProblem
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
    begin = np.array(list(state.sensor)), np.array([list(pose) for pose in state.lights]).reshape(-1)
    limits = Constraints(same_side([state.sensor]), same_side(state.lights))
    aim = Aim("object", "sum", np.eye(len(scene.quantities))[state.measurand])
    problem = SearchProblem(scene, "calibrated", aim, limits)

    def variance(sensor: np.ndarray, lights: np.ndarray) -> float:
        return float(problem.errors(sensor[None], lights[None]).variances_object.reshape(-1)[state.measurand])

    if not np.isfinite(problem.where_feasible(variance)(*begin)):
        raise InvalidInput("the descent must begin where the measurand can be measured and bodies are clear")
    end = refine(problem, begin, _STEP_DEG, value=variance)
    poses = [Pose(*map(float, pose.round(2))) for pose in (end.sensor, *end.lights.reshape(-1, 2))]
    return replace(state, sensor=poses[0], lights=tuple(poses[1:]))
