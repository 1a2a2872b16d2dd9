"""What the search of a grid found: its clearly different candidates, and the best of them that can be trusted.

A search minimises variances by fast evaluation. Bias, and what is too near for either to be told, are known of a single
picture only (`planner.predict`): of the clearly different settings the best is taken in which nothing is `clutter`, as
long as it does not cost too much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from imaging.geometry.projection import direction
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.prediction import Prediction, predict
from planner.search.exhaustive import BestPair, best_pair
from planner.search.grid import APART, Feasible, Grid, as_array, as_poses, distinct
from planner.search.lights import Mixture, best_lights
from planner.search.local import Partial, alternating
from planner.search.objective import Report, SearchProblem, minimised
from planner.search.setting_up import rounded
from scenes import Picture, Pose
from scenes.pose import DIGITS
from scenes.status import is_trusted

DEAREST = 4.0  # times the least variance that is paid for trust: standard deviations are twice as large


@dataclass(frozen=True, eq=False)
class Searched:
    """The search of a grid for one set of required edges.

    Attributes
    ----------
    problem : SearchProblem
        Of several lights with the best shares.
    grid : Grid
        Of several lights with the best ones for each sensor.
    sensor, light : ndarray, shape (2,), (2 F,)
    variance : float
        The best pair, and what is minimised there.
    partial : Partial or None
        Of the alternating search.
    found : BestPair or None
        Of the exhaustive one.
    alone : Mixture or None
        Of two lights the best where one of them has all.
    """

    problem: SearchProblem
    grid: Grid
    sensor: np.ndarray
    light: np.ndarray
    variance: float
    partial: Partial | None = None
    found: BestPair | None = None
    alone: Mixture | None = None

    @classmethod
    def of(cls, problem: SearchProblem, grid: Grid, search: str, start: Any, shares: str, report: Report) -> Searched:
        """Search all poses of a grid, and the shares of two lights where asked."""
        scene, limits = problem.scene, problem.constraints
        if len(scene.lights) > 1 and (grid.free or (scene.free and not grid.held[1])):
            shared = best_lights(problem, grid, shares, report)
            problem, grid = replace(problem, scene=shared.scene), replace(grid, lights=shared.lights)
            at = shared.found.sensor
            best = grid.sensors[at], shared.lights[at], shared.found.variance
            return cls(problem, grid, *best, found=shared.found, alone=shared.alone)
        partial = found = None
        plain = grid.free and len(scene.free) == 1 and not limits.coupled
        if plain:
            spaces = (Feasible(grid.step_deg, poses) for poses in (grid.sensors, grid.lights))
            partial = alternating(problem, *spaces, np.array(list(Pose.of(start))))
        if search == "exhaustive" or not plain:
            found = best_pair(problem, grid.sensors, grid.lights, report)
        best = found or partial
        return cls(
            problem, grid, grid.sensors[best.sensor], grid.lights[best.light], best.variance, partial, found
        )  # fmt: skip

    def rows(self, count: int) -> list[tuple[float, Searched, np.ndarray, np.ndarray]]:
        """What is minimised, of which search, sensor and lights: of clearly different sensors and of the best pair."""
        best = (self.variance, self, self.sensor, self.light)
        if self.found is None:
            return [best] if np.isfinite(self.variance) else []
        order = np.argsort(self.found.least)
        order = order[np.isfinite(self.found.least[order])]
        picked = order[_spread(direction(self.grid.sensors[order]), count)]
        lights = self.grid.lights[self.found.best_light[picked]]
        least = self.found.least[picked]
        return [*((v, self, *pair) for v, *pair in zip(least, self.grid.sensors[picked], lights, strict=True)), best]


@dataclass(frozen=True)
class Candidate:
    """A setting worth considering.

    Attributes
    ----------
    sensor : Pose
    light : Pose or tuple of Pose
        Of the lights that are free.
    edges : tuple of str
        Required edges.
    variance_object, variance_image : float
        Of the measurand that limits it: the scene's unit squared and px^2, or degrees^2.
    variance : float
        What the plan minimises.
    limiting : str
        Name of that measurand.
    """

    sensor: Pose
    light: Pose | tuple[Pose, ...]
    edges: tuple[str, ...]
    variance_object: float
    variance_image: float
    variance: float
    limiting: str


def candidates(searches: Sequence[Searched], count: int = 10) -> tuple[Candidate, ...]:
    """The best settings whose sensors or lights differ by 15 degrees, over all sets of required edges."""
    rows = sorted((row for each in searches for row in each.rows(count)), key=lambda row: row[0])
    chosen = distinct(rows, _differ, 2 * count)
    made = [_candidate(searched, sensor, light) for _, searched, sensor, light in chosen]
    return tuple(sorted(made, key=lambda c: c.variance)[:count])


def _candidate(searched: Searched, sensor: np.ndarray, light: np.ndarray) -> Candidate:
    """At the digits of poses that are printed, but for what is held."""
    problem, held = searched.problem, searched.grid.held
    sensor, light = (pose if kept else rounded(pose) for pose, kept in zip((sensor, light), held, strict=True))
    poses = Pose(*map(float, sensor)), as_poses(light)
    found = variance_model(problem.model)(Pictures.of(Picture.of(problem.scene, *poses)))
    worst = int(np.argmax(found.variances_object * problem.objective.shares))
    return Candidate(
        *poses,
        problem.scene.required,
        float(found.variances_object[worst]),
        float(found.variances[worst]),
        float(minimised(found, problem.objective)),
        problem.scene.quantities[worst].name,
    )


def _spread(directions: np.ndarray, count: int) -> list[int]:
    """The first of the directions, then each next one that is far from all before."""
    picked: list[int] = []
    open_ = np.ones(len(directions), bool)
    while open_.any() and len(picked) < count:
        picked.append(int(np.argmax(open_)))
        open_ &= directions @ directions[picked[-1]] < np.cos(np.radians(APART))
    return picked


def _differ(row: tuple, other: tuple) -> bool:
    """Whether sensors or lights are clearly apart."""
    near = np.cos(np.radians(APART))
    pairs = zip(_each(row), _each(other), strict=True)
    return any(direction(one) @ direction(two) < near for one, two in pairs)


def _each(row: tuple) -> np.ndarray:
    """Poses of sensor and lights, (1 + F, 2)."""
    return np.concatenate([row[2], row[3]]).reshape(-1, 2)


class RayTraced(NamedTuple):
    """A setting by ray-traced evaluation.

    ``value`` is what is minimised, ``untrusted`` counts the measurands that are not ``ok``.
    """

    sensor: np.ndarray
    light: np.ndarray
    prediction: Prediction
    value: float
    untrusted: int

    @classmethod
    def of(cls, problem: SearchProblem, sensor: np.ndarray, light: np.ndarray) -> RayTraced:
        """Of a sensor (2,) and the free lights (2 F,), degrees."""
        told = predict(problem.scene, tuple(map(float, sensor)), as_poses(light), problem.model)
        variances = [getattr(each, f"variance_{problem.objective.unit}") for each in told.measurands]
        untrusted = sum(not is_trusted(each.status) for each in told.measurands)
        return cls(sensor, light, told, float(problem.objective(np.array(variances))), untrusted)


def trusted(
    problem: SearchProblem, best: RayTraced, choice: Sequence[Candidate], variance: float
) -> tuple[RayTraced, tuple[Candidate, ...]]:
    """The setting with the fewest measurands that are not ``ok``, the best of them, and the better ones set aside.

    Parameters
    ----------
    best : RayTraced
        The least variance.
    choice : sequence of Candidate
        The others, the best first; none of more than 4 times ``variance`` is taken.
    """
    least, passed, set_aside = best, [], ()
    for candidate in choice:
        if least.untrusted == 0 or candidate.variance > DEAREST * variance:
            break
        if candidate.edges != problem.scene.required:
            continue
        poses = np.array(list(candidate.sensor)), as_array(candidate.light)
        if not all(np.allclose(pose, own, atol=10.0**-DIGITS) for pose, own in zip(poses, best[:2], strict=True)):
            other = RayTraced.of(problem, *poses)
            if other.untrusted < least.untrusted:
                least, set_aside = other, tuple(passed)
        passed.append(candidate)
    return least, set_aside
