"""Where to stand for the smallest expanded uncertainty against the tolerance, not for the least noise alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.budgeting.budgets import SceneBudget, budget
from planner.budgeting.features import Features
from planner.budgeting.sensitivities import sensitivities
from planner.budgeting.sources import Source, sources
from planner.search.constraints import Constraints
from planner.search.grid import ViewingSpace, as_array, as_poses, by_light
from planner.search.local import refine
from planner.search.objective import Aim
from scenes import InvalidInput, Picture, Pose, Scene, several

_PAIRS = 20_000  # at a time
STEP_DEG = 10.0

Report = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Placed:
    """A setting and its budget.

    Attributes
    ----------
    sensor : Pose
    light : Pose or tuple of Pose
    budget : SceneBudget
    """

    sensor: Pose
    light: Pose | tuple[Pose, ...]
    budget: SceneBudget

    @property
    def ratios(self) -> tuple[float, ...]:
        """Expanded uncertainty over half of the tolerance zone of each measurand that has one."""
        pairs = zip(self.budget.measurands, self.budget.prediction.measurands, strict=True)
        return tuple(found.U / told.tolerance.half for found, told in pairs if told.tolerance is not None)


@dataclass(frozen=True, eq=False)
class CapabilityPlan:
    """The setting of the smallest worst U / T, and that of the least noise alone.

    Attributes
    ----------
    best, quiet : Placed
        With everything in the budget, and with pixel noise alone.
    pairs : int
        Pairs of the grid that were evaluated.
    """

    best: Placed
    quiet: Placed
    pairs: int


def plan_capability(
    scene: Scene,
    *,
    step_deg: float = STEP_DEG,
    constraints: Constraints | None = None,
    sensor: Any = None,
    light: Any = None,
    refined: bool = True,
    p: float = 0.95,
    report: Report | None = None,
) -> CapabilityPlan:
    """Find the poses at which the worst expanded uncertainty over its tolerance is smallest.

    At every pair of a grid the variance of each measurand is that by pixel noise (``calibrated``) plus the sum of
    (c u)^2 over the inputs that move places in the image, whose sensitivities c depend on the sensor alone; then a
    descent below the grid. What depends on the estimator (its model error) or on levels counts in the budgets that are
    told, not in the search.

    Parameters
    ----------
    scene : Scene
        Each of several measurands with a tolerance.
    step_deg : float
        Of the grid.
    constraints : Constraints, optional
    sensor, light : Pose or pair, optional
        Hold one fixed.
    refined : bool
        Whether to descend below the grid.
    p : float
        Coverage probability of the expanded uncertainties.

    Raises
    ------
    InvalidInput
        If no allowed setting can measure, or a tolerance is missing.
    """
    aim, limits = Aim.of(scene.quantities, "object"), constraints or Constraints()
    sensors, lights = _grid(scene, limits, step_deg, sensor, light)
    given, report = sources(scene), report or (lambda *_: None)
    moved = np.zeros((len(sensors), len(scene.quantities)))
    for k, pose in enumerate(sensors):
        moved[k] = systematic(scene, pose, given)
        report("sensitivities", k + 1, 2 * len(sensors))
    whole, quiet = _searched(scene, sensors, lights, moved, aim, limits, report)
    free = refined and sensor is None and light is None
    found = []
    for (i, j), beside in ((whole, given), (quiet, ())):
        at = sensors[i], lights[j]
        if free:
            how = "calibrated", aim, step_deg, limits
            at = refine(scene, *at, *how, value=_value(scene, aim, beside))[:2]
        poses = tuple(map(float, at[0])), as_poses(at[1])
        found.append(Placed(Pose(*poses[0]), poses[1], budget(scene, *poses, p=p)))
    return CapabilityPlan(*found, pairs=len(sensors) * len(lights))


def systematic(scene: Scene, sensor: np.ndarray, given: tuple[Source, ...]) -> np.ndarray:
    """Variance of each quantity by the inputs that move places in the image, at a sensor's pose (2,), shape (M,)."""
    still = tuple(each for each in given if each.kind == "geometry")
    count = len(scene.quantities)
    if not still:
        return np.zeros(count)
    pictures = Pictures.of(scene, sensor, _anywhere(scene))
    with np.errstate(all="ignore"):
        slopes = sensitivities(Features(pictures), still, biased=False)
        u = np.array([each.told.u for each in still])
        spread = slopes * u
        return np.einsum("mi,ij,mj->m", spread, _correlation(scene, still), spread)


def _correlation(scene: Scene, given: tuple[Source, ...]) -> np.ndarray:
    whole, told = np.eye(len(given)), scene.uncertainty.covariance
    if told is not None:
        places = [[each.name for each in given].index(name) for name in told.names]
        whole[np.ix_(places, places)] = told.correlation
    return whole


def _anywhere(scene: Scene) -> Any:
    """Free lights above the object: where they stand does not matter to places, only to rims' weights."""
    return tuple(np.array([20.0, 0.0]) for _ in scene.free) if len(scene.free) != 1 else np.array([20.0, 0.0])


def _grid(scene: Scene, limits: Constraints, step: float, sensor: Any, light: Any) -> tuple[np.ndarray, np.ndarray]:
    sensors = ViewingSpace(step, limits.sensor_polar_deg).poses
    sensors = sensors[limits.sensors(scene, sensors)]
    if sensor is not None:
        sensors = np.array([list(scene.check_pose("sensor", sensor))])
    if len(scene.free) > 1 and light is None:
        raise InvalidInput(f"light must be given for a scene of {len(scene.free)} free lights, got nothing")
    lights = ViewingSpace(step, limits.light_polar_deg).poses if scene.free else np.zeros((1, 0))
    lights = lights[limits.lights(lights)] if scene.free else lights
    if light is not None:
        lights = as_array(scene.check_lights(several(light)))[None]
    if not len(sensors) or not len(lights):
        raise InvalidInput("constraints must leave a pose for sensor and light, got none")
    return sensors, lights


def _searched(scene, sensors, lights, moved, aim, limits, report) -> tuple[tuple[int, int], tuple[int, int]]:
    """Indices of the best pair with everything, and by noise alone."""
    evaluate, size = variance_model("calibrated"), max(1, _PAIRS // len(lights))
    best: list[tuple[float, int, int]] = [(np.inf, 0, 0)] * 2
    for at in range(0, len(sensors), size):
        part = sensors[at : at + size]
        noise = evaluate(Pictures.of(scene, part[:, None], by_light(lights[None]))).variances_object
        allowed = limits.pairs(scene, part[:, None], lights[None]) if limits.on_pairs else True
        beside = moved[at : at + size, None]
        for k, variances in enumerate((noise + np.where(np.isfinite(beside), beside, np.inf), noise)):
            values = np.where(allowed, aim(variances), np.inf)
            i, j = np.unravel_index(int(values.argmin()), values.shape)
            if values[i, j] < best[k][0]:
                best[k] = float(values[i, j]), at + int(i), int(j)
        report("pairs", len(sensors) + min(at + size, len(sensors)), 2 * len(sensors))
    if not np.isfinite(best[0][0]):
        raise InvalidInput("constraints must leave a setting that can measure, got none")
    return best[0][1:], best[1][1:]


def _value(scene: Scene, aim: Aim, given: tuple[Source, ...]) -> Callable[[np.ndarray, np.ndarray], float]:
    def value(sensor: np.ndarray, light: np.ndarray) -> float:
        picture = Picture.of(scene, tuple(map(float, sensor)), as_poses(light))
        noise = variance_model("calibrated")(Pictures.of(picture)).variances_object
        found = float(aim(noise + systematic(scene, sensor, given)))
        return found if np.isfinite(found) else np.inf

    return value
