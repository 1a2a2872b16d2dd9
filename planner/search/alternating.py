"""The paper's search: sensor and light move in turn, each from neighbour to neighbour (its Figs 7 and 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.search.constraints import Constraints
from planner.search.exhaustive import evaluate_pairs
from planner.search.viewing import ViewingSpace
from scenes import Pose, Scene

_MOST_TURNS = 100


@dataclass(frozen=True)
class Step:
    """One row of the paper's Table 1: what was held fixed, what was found, and the variance there."""

    fixed: str
    fixed_pose: Pose
    found: str
    found_pose: Pose
    variance: float


@dataclass(frozen=True)
class Partial:
    """Where the alternating search stops: no neighbour of the sensor and none of the light is better."""

    sensor: int
    light: int
    variance: float
    trace: tuple[Step, ...]


def alternate(
    scene: Scene, sensors: ViewingSpace, lights: ViewingSpace, start: np.ndarray, model: str, objective: str,
    first_light: np.ndarray | None = None, constraints: Constraints | None = None,
) -> Partial:  # fmt: skip
    """The paper's procedure FindSensorLight for one set of required edges.

    Parameters
    ----------
    sensors, lights : ViewingSpace
    start : ndarray, shape (2,)
        Where the sensor stands at first, degrees; the nearest direction is taken.
    first_light : ndarray, shape (2,), optional
        Where the search for the first light begins. Where nothing can be measured from there (or nothing is given),
        it begins at the best of a coarse sample of the directions, for a plateau of infinities has no way down.
    constraints : Constraints, optional
        On pairs: others count as not measurable.
    """
    at = {"sensor": sensors.nearest(start), "light": 0 if first_light is None else lights.nearest(first_light)}
    spaces = {"sensor": sensors, "light": lights}
    trace: list[Step] = []
    variance, moving = np.inf, "light"
    for _ in range(_MOST_TURNS):
        fixed = "sensor" if moving == "light" else "light"

        def value(indices: np.ndarray, moving=moving, fixed=fixed) -> np.ndarray:
            poses = {moving: spaces[moving].poses[indices], fixed: spaces[fixed].poses[[at[fixed]] * len(indices)]}
            values = evaluate_pairs(scene, poses["sensor"], poses["light"], model, objective)
            if constraints is not None and constraints.on_pairs:
                values = np.where(constraints.pairs(scene, poses["sensor"], poses["light"]), values, np.inf)
            return values

        before = at[moving]
        at[moving], variance = _descend(spaces[moving], before, value)
        poses = {role: Pose(*map(float, spaces[role].poses[at[role]])) for role in spaces}
        trace.append(Step(fixed, poses[fixed], moving, poses[moving], variance))
        if at[moving] == before and len(trace) > 1:
            break
        moving = fixed
    return Partial(at["sensor"], at["light"], variance, tuple(trace))


def _descend(space: ViewingSpace, index: int, value) -> tuple[int, float]:
    """Go to the best neighbour until none is better."""
    best = float(value(np.array([index]))[0])
    if not np.isfinite(best):
        sample = np.arange(0, len(space), max(1, len(space) // 500))
        values = value(sample)
        index, best = int(sample[values.argmin()]), float(values.min())
    while True:
        around = space.neighbours(index)
        values = value(around)
        if not len(around) or not values.min() < best:
            return index, best
        index, best = int(around[values.argmin()]), float(values.min())
