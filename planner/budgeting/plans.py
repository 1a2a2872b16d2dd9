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
from planner.budgeting.products import products
from planner.budgeting.sensitivities import sensitivities
from planner.budgeting.sources import Source, sources
from planner.constraints import Constraints
from planner.search.grid import Grid, as_poses
from planner.search.local import refine
from planner.search.objective import Report, SearchProblem
from scenes import InvalidInput, Picture, Pose, Scene

STEP_DEG = 10.0


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
    problem = SearchProblem.of(scene, "calibrated", "object", (constraints or Constraints()).on_side_of(scene))
    report = report or (lambda *_: None)
    if len(scene.free) > 1 and light is None:
        raise InvalidInput(f"light must be given for a scene of {len(scene.free)} free lights, got nothing")
    grid, given = Grid.of(scene, problem.constraints, step_deg, sensor, light), sources(scene)
    moved = np.zeros((len(grid.sensors), len(scene.quantities)))
    for k, pose in enumerate(grid.sensors):
        moved[k] = systematic(scene, pose, given)
        report("finding sensitivities", k + 1, 2 * len(grid.sensors))
    whole, quiet = _searched(problem, grid, moved, report)
    found = []
    for (i, j), beside in ((whole, given), (quiet, ())):
        pair = grid.sensors[i], grid.lights[j]
        if refined and grid.free:
            pair = refine(problem, pair, step_deg, value=_value(problem, beside))[:2]
        poses = tuple(map(float, pair[0])), as_poses(pair[1])
        found.append(Placed(Pose(*poses[0]), poses[1], budget(scene, *poses, p=p)))
    return CapabilityPlan(*found, pairs=len(grid.sensors) * len(grid.lights))


def systematic(
    scene: Scene, sensor: np.ndarray, given: tuple[Source, ...], *, closely: bool = True, of_rims: bool = True
) -> np.ndarray:
    """Variance of each quantity by the inputs that move places in the image, at a sensor's pose (2,), shape (M,).

    Not ``closely``: rims count as they do in a search, which is 25 times faster and differs by a few per cent. Without
    rims what depends on circles is NaN.
    """
    still = tuple(each for each in given if each.kind == "geometry")
    count = len(scene.quantities)
    if not still:
        return np.zeros(count)
    pictures = Pictures.of(scene, sensor, _anywhere(scene))
    with np.errstate(all="ignore"):
        features = Features(pictures if closely else pictures.glanced, of_rims)
        slopes = sensitivities(features, still, biased=False)
        u = np.array([each.told.u for each in still])
        spread = slopes * u
        return np.einsum("mi,ij,mj->m", spread, _correlation(scene, still), spread) + products(features, still) ** 2


def _correlation(scene: Scene, given: tuple[Source, ...]) -> np.ndarray:
    whole, told = np.eye(len(given)), scene.uncertainty.covariance
    if told is not None:
        places = [[each.name for each in given].index(name) for name in told.names]
        whole[np.ix_(places, places)] = told.correlation
    return whole


def _anywhere(scene: Scene) -> Any:
    """Free lights above the object: where they stand does not matter to places, only to rims' weights."""
    return tuple(np.array([20.0, 0.0]) for _ in scene.free) if len(scene.free) != 1 else np.array([20.0, 0.0])


def _searched(problem: SearchProblem, grid: Grid, moved: np.ndarray, report: Report) -> tuple[tuple, tuple]:
    """Indices of the best pair with everything, and by noise alone."""
    best: list[tuple[float, int, int]] = [(np.inf, 0, 0)] * 2
    count = len(grid.sensors)

    def later(name: str, done: int, _: int) -> None:
        report(name, count + done, 2 * count)

    for part, errors, allowed in problem.table(grid.sensors, grid.lights, later):
        noise, beside = errors.variances_object, moved[part, None]
        for k, variances in enumerate((noise + np.where(np.isfinite(beside), beside, np.inf), noise)):
            values = np.where(allowed, problem.objective(variances), np.inf)
            i, j = np.unravel_index(int(values.argmin()), values.shape)
            if values[i, j] < best[k][0]:
                best[k] = float(values[i, j]), part.start + int(i), int(j)
    if not np.isfinite(best[0][0]):
        raise InvalidInput("constraints must leave a setting that can measure, got none")
    return best[0][1:], best[1][1:]


def _value(problem: SearchProblem, given: tuple[Source, ...]) -> Callable[[np.ndarray, np.ndarray], float]:
    def value(sensor: np.ndarray, light: np.ndarray) -> float:
        picture = Picture.of(problem.scene, tuple(map(float, sensor)), as_poses(light))
        noise = variance_model(problem.model)(Pictures.of(picture)).variances_object
        found = float(problem.objective(noise + systematic(problem.scene, sensor, given)))
        return found if np.isfinite(found) else np.inf

    return value
