"""One set of required edges, where its sensor and light may stand, and the search of all of these."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.search.constraints import Constraints
from planner.search.exhaustive import Found, Report, exhaustive, has_bound
from planner.search.grid import ViewingSpace, as_array
from planner.search.lights import Shared, applies, by_turns, search_shared, shares_of, shares_of_two
from planner.search.local import Partial, alternate
from planner.search.objective import Aim
from scenes import InvalidInput, Pose, Scene, Task, several

COARSE_STEP = 10.0  # degrees; where every pair has to be evaluated


def with_task(scene: Scene, task: Task) -> Scene:
    """The scene with another task."""
    return scene.model_copy(update={"task": task})


def held(scene: Scene, constraints: Constraints, sensor: Any, light: Any) -> tuple[Any, Any]:
    """The poses that are held fixed, once they keep the constraints on pairs; on one mount the one says the other."""
    if constraints.same_mount:
        sensor, light = (light if sensor is None else sensor), (sensor if light is None else light)
    if sensor is not None and light is not None:
        pose, lights = scene.check_pose("sensor", sensor), scene.check_lights(several(light))
        if not constraints.pairs(scene, np.array(list(pose)), as_array(lights)):
            raise InvalidInput(
                f"sensor and light must keep the constraints on both (mount, separation, bodies, view), got {pose} and "
                + " ".join(map(str, lights))
            )
    return sensor, light


@dataclass(frozen=True)
class Result:
    """What searching one set of required edges gave."""

    sensor: np.ndarray
    light: np.ndarray
    variance: float
    partial: Partial | None
    found: Found | None
    shared: Shared | None = None


@dataclass(frozen=True, eq=False)
class Option:
    """One set of required edges and where its sensor and light may stand."""

    scene: Scene
    model: str
    step_deg: float
    constraints: Constraints
    sensors: np.ndarray
    lights: np.ndarray
    free: bool

    @classmethod
    def of(cls, scene: Scene, model: str, step_deg: float | None, constraints: Constraints, sensor, light) -> Option:
        """All allowed poses of a grid, or the one at which ``sensor`` or ``light`` is held."""
        fast = has_bound(scene, model)
        step = (1.0 if fast else COARSE_STEP) if step_deg is None else step_deg
        sensors = ViewingSpace(step, constraints.sensor_polar_deg).poses
        lights = ViewingSpace(step, constraints.light_polar_deg).poses if scene.free else np.zeros((1, 0))
        sensors = sensors[constraints.sensors(scene, sensors)]
        lights = lights[constraints.lights(lights)] if scene.free else lights
        if sensor is not None:
            sensors = np.array([list(scene.check_pose("sensor", sensor))])
            _check_allowed("sensor", sensors, constraints.sensors(scene, sensors))
        if light is not None:
            lights = as_array(scene.check_lights(several(light)))[None]
            _check_allowed("light", lights.reshape(-1, 2), constraints.lights(lights.reshape(-1, 2)))
        if not len(sensors) or not len(lights):
            raise InvalidInput("constraints must leave a pose for sensor and light, got none")
        return cls(scene, model, step, constraints, sensors, lights, sensor is None and light is None)

    def search(self, aim: Aim, search: str, start: Any, report: Report | None, shares: bool) -> Result:
        """Search all of these poses, and the shares of two lights where asked."""
        if len(self.scene.lights) > 1 and self.free:
            return self._search_lights(aim, report, shares)
        partial = found = None
        plain = self.free and len(self.scene.free) == 1 and not self.constraints.coupled
        if plain:
            spaces = (_Allowed(self.step_deg, poses) for poses in (self.sensors, self.lights))
            begin, limits = np.array(list(Pose.of(start))), self.constraints
            partial = alternate(self.scene, *spaces, begin, self.model, aim, constraints=limits)
        if search == "exhaustive" or not plain:
            found = exhaustive(self.scene, self.sensors, self.lights, self.model, aim, self.constraints, report)
        best = found or partial
        return Result(self.sensors[best.sensor], self.lights[best.light], best.variance, partial, found)

    def _search_lights(self, aim: Aim, report: Report | None, shares: bool) -> Result:
        """Several lights at once, or one after the other where their contrasts do not tell of mixtures."""
        how = self.scene, self.sensors, self.lights, self.model, aim, self.constraints, report or (lambda *_: None)
        mixed = shares_of_two(self.scene) if shares and len(self.scene.lights) == 2 else (shares_of(self.scene),)
        shared = (search_shared if applies(self.scene, self.model) else by_turns)(*how, mixed)
        found = shared.found
        return Result(self.sensors[found.sensor], shared.lights[found.light], found.variance, None, found, shared)

    def with_lights(self, shared: Shared | None) -> Option:
        """With the lights that a search of several found for each sensor."""
        return self if shared is None else replace(self, scene=shared.scene, lights=shared.lights)


class _Allowed(ViewingSpace):
    """A viewing space of the allowed poses only."""

    def __init__(self, step_deg: float, poses: np.ndarray) -> None:
        super().__init__(step_deg)
        self.__dict__["poses"] = poses


def _check_allowed(role: str, poses: np.ndarray, allowed: np.ndarray) -> None:
    """See that a pose that is held fixed is one that the constraints allow."""
    if not allowed.all():
        raise InvalidInput(f"{role} must keep the constraints, got {Pose(*map(float, poses[0]))}")
