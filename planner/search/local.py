"""Local searches: Nelder-Mead below the grid, and the paper's search from neighbour to neighbour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.geometry.projection import direction
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.prediction import minimised
from planner.search.constraints import Constraints
from planner.search.exhaustive import cut_off, evaluate_pairs
from planner.search.grid import ViewingSpace, by_light
from scenes import InvalidInput, Pose, Scene


def refine(
    scene: Scene, sensor: np.ndarray, light: np.ndarray, model: str, objective: str, step_deg: float,
    constraints: Constraints | None = None, value=None, sizes: tuple[float, ...] = (0.7, 0.1),
    known: float = np.inf,
) -> tuple[np.ndarray, np.ndarray, float]:  # fmt: skip
    """Nelder-Mead from poses of a sensor and of all free lights.

    In tangent planes of the sphere, so that the poles are places like others.

    Parameters
    ----------
    sensor : ndarray, shape (2,)
    light : ndarray, shape (2 F,)
        Where to begin, degrees.
    step_deg : float
        What the sizes are parts of.
    value : callable, optional
        (sensor, light) to what is minimised; the variance when not given.
    sizes : tuple of float
        Of the simplices, one after the other: a fresh one, for the one before may have collapsed at a border.
    known : float
        What a search found at the beginning; it stands where rounding tells the other way whether a plane that is
        seen edge-on is seen, or a border kept.

    Returns
    -------
    sensor : ndarray, shape (2,)
    light : ndarray, shape (2 F,)
    variance : float
        Not more than at the beginning.

    Raises
    ------
    InvalidInput
        If the beginning is not allowed, or nothing can be measured there.
    """
    constraints = constraints or Constraints()
    if value is None:
        value = _variance(scene, sensor, light, model, objective)

    begin = np.concatenate([sensor, light]).reshape(-1, 2)

    def moved(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        places = [shifted(pose, step_deg * by) for pose, by in zip(begin, x.reshape(-1, 2), strict=True)]
        if constraints.same_mount:
            places[1:] = [places[0]] * (len(places) - 1)
        return places[0], np.concatenate([np.zeros(0), *places[1:]])

    def cost(x: np.ndarray) -> float:
        s, k = moved(x)
        return value(s, k) if constraints.allows(scene, s, k) else np.inf

    unit = cost(np.zeros(begin.size))
    unit = unit if np.isfinite(unit) else known
    if not np.isfinite(unit):
        raise InvalidInput(f"refinement must begin at a pose that is allowed and measurable, got {sensor}, {light}")
    from scipy.optimize import minimize  # slow to load, and rarely needed

    x, least = np.zeros(begin.size), 1.0
    for size in sizes:
        found = minimize(
            lambda x: min(cost(x) / unit, np.finfo(float).max) if x.any() else 1.0, x, method="Nelder-Mead",
            options={"initial_simplex": x + size * np.vstack([np.zeros(x.size), np.eye(x.size)]), "xatol": 1e-3,
                     "fatol": 1e-7, "maxfev": 250 if x.size <= 4 else 400},
        )  # fmt: skip
        if found.fun < least:
            x, least = found.x, found.fun
    return *moved(x), float(least * unit)


def _variance(scene: Scene, sensor: np.ndarray, light: np.ndarray, model: str, objective: str):
    """The variance of one setting; infinite where levels are cut off, unless they are at the beginning."""

    def told(s: np.ndarray, k: np.ndarray) -> tuple[float, bool]:
        errors = variance_model(model)(Pictures.of(scene, s[None], by_light(k[None])))
        return float(minimised(errors, objective)[0]), bool(cut_off(errors, scene)[0])

    anyway = told(sensor, light)[1]

    def value(s: np.ndarray, k: np.ndarray) -> float:
        found, cut = told(s, k)
        return np.inf if cut and not anyway else found

    return value


def shifted(pose: np.ndarray, by_deg: np.ndarray) -> np.ndarray:
    """The pose moved on its sphere by two perpendicular angles (degrees)."""
    centre = direction(pose)
    helper = np.eye(3)[np.argmin(np.abs(centre))]
    one = np.cross(centre, helper)
    one /= np.linalg.norm(one)
    x, y, z = centre + np.tan(np.radians(by_deg[0])) * one + np.tan(np.radians(by_deg[1])) * np.cross(centre, one)
    return np.array([np.degrees(np.arctan2(np.hypot(x, y), z)), np.degrees(np.arctan2(y, x)) % 360])


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
