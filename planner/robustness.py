"""Plans for inputs that are not known exactly: how the optimum moves, and the setting whose worst case is least."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import product

import numpy as np

from imaging.geometry.projection import direction
from planner.constraints import Constraints
from planner.planning import Plan
from planner.search.local import refine, shifted
from planner.search.objective import Aim, SearchProblem
from scenes import InvalidInput, Material, Pose, Scene


@dataclass(frozen=True)
class Tolerances:
    """How far each input may be off: relative for the material and the noise, degrees for the poses.

    A tolerance of 0.1 means from 0.9 to 1.1 times the scene's value; values that have a natural limit stop there.
    """

    diffuse_reflectance: float = 0.0
    specular_fraction: float = 0.0
    roughness: float = 0.0
    refractive_index: float = 0.0
    noise: float = 0.0
    sensor_deg: float = 0.0
    light_deg: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 <= value < (1 if not field.name.endswith("deg") else 90):
                raise InvalidInput(f"tolerance of {field.name} must be at least 0 and small, got {value}")

    @property
    def of_the_scene(self) -> tuple[str, ...]:
        """Names of the scene's uncertain values."""
        names = (field.name for field in fields(self) if not field.name.endswith("deg"))
        return tuple(name for name in names if getattr(self, name) > 0)


@dataclass(frozen=True)
class Move:
    """What one input's error does to a plan.

    Attributes
    ----------
    input : str
    factor : float
        Of the scene's value.
    variance : float
        At the plan's poses, over the plan's variance.
    best : float
        At the poses that would then be best, over the plan's variance.
    sensor_deg, light_deg : float
        How far those lie from the plan's.
    """

    input: str
    factor: float
    variance: float
    best: float
    sensor_deg: float
    light_deg: float


@dataclass(frozen=True)
class Robust:
    """The setting of the least worst case.

    Attributes
    ----------
    sensor, light : Pose
    worst, nominal : float
        Its worst variance within the tolerances, and its variance if all inputs are right.
    plan_worst : float
        The worst variance of the plan that trusts its inputs.
    moves : tuple of Move
        How that plan's optimum moves, one input at a time.
    cases : int
        Number of cases the worst is taken over: all combinations of the scene's extremes, with no pose error or one.
    """

    sensor: Pose
    light: Pose
    worst: float
    nominal: float
    plan_worst: float
    moves: tuple[Move, ...]
    cases: int


def altered(scene: Scene, factors: dict[str, float]) -> Scene:
    """The scene with some values multiplied; fractions and reflectances stop at 1, the refractive index at 1."""
    noise = scene.noise.model_copy(update={"sigma": scene.noise.sigma * factors.get("noise", 1.0)})
    materials = tuple(_altered(each, factors) for each in scene.materials)
    return scene.model_copy(
        update={"material": _altered(scene.material, factors), "materials": materials, "noise": noise}
    )


def _altered(material: Material, factors: dict[str, float]) -> Material:
    found = {}
    for name, factor in factors.items():
        if name != "noise":
            value = getattr(material, name) * factor
            limits = (1.0, np.inf) if name == "refractive_index" else (0.0, np.inf if name == "roughness" else 1.0)
            keep = name == "refractive_index" and material.refractive_index < 1
            found[name] = value if keep else float(np.clip(value, *limits))
    return material.model_copy(update=found)


def check_robust(scene: Scene, tolerances: Tolerances) -> None:
    """See that a plan of a scene can be made robust.

    Raises
    ------
    InvalidInput
        If no tolerance is given, or the scene has other than one light that is free.
    """
    if tolerances == Tolerances():
        raise InvalidInput("tolerances must be given for at least one input, got none")
    if len(scene.lights) != 1 or not scene.free:
        raise InvalidInput(
            f"tolerances must be left out but for one light that is free, got {len(scene.lights)} lights"
        )


def robust(plan: Plan, tolerances: Tolerances, constraints: Constraints | None = None) -> Robust:
    """Minimum of the worst case, from the plan's clearly different candidates downhill.

    No guarantee: the worst case is a maximum over the corners of the tolerances, and the descent is local.

    Raises
    ------
    InvalidInput
        As `check_robust`, or if nothing can always measure.
    """
    check_robust(plan.scene, tolerances)
    names, problem = tolerances.of_the_scene, _problem(plan, constraints)
    corners = [dict(zip(names, signs, strict=True)) for signs in product((-1, 1), repeat=len(names))]
    factors = [{n: 1 + sign * getattr(tolerances, n) for n, sign in corner.items()} for corner in corners]
    worlds = [replace(problem, scene=altered(plan.scene, each)) for each in factors]

    def worst(sensor: np.ndarray, light: np.ndarray) -> float:
        pairs = _with_pose_errors(sensor, light, tolerances)
        return max(float(world.values(*pairs).max()) for world in worlds)

    starts = [plan.poses]
    starts += [(c.sensor, c.light) for c in plan.candidates[:6] if c.edges == plan.scene.required]
    starts = [tuple(np.array(list(pose)) for pose in pair) for pair in starts]
    values = [worst(*pair) for pair in starts]
    best = int(np.argmin(values))
    if not np.isfinite(values[best]):
        raise InvalidInput("tolerances must leave a setting that can always measure, got none")
    end = refine(problem, starts[best], 2.0, value=worst)
    return Robust(
        sensor=Pose(*map(float, end.sensor)),
        light=Pose(*map(float, end.lights)),
        worst=end.value,
        nominal=float(problem.values(end.sensor[None], end.lights[None])[0]),
        plan_worst=values[0],
        moves=tuple(_move(plan, problem, n, sign * getattr(tolerances, n)) for n in names for sign in (-1, 1)),
        cases=len(worlds) * len(_with_pose_errors(end.sensor, end.lights, tolerances)[0]),
    )


def _problem(plan: Plan, constraints: Constraints | None) -> SearchProblem:
    aim = Aim.of(plan.scene.quantities, plan.objective, plan.over)
    return SearchProblem(plan.scene, plan.model, aim, (constraints or Constraints()).on_side_of(plan.scene))


def _with_pose_errors(sensor: np.ndarray, light: np.ndarray, tolerances: Tolerances) -> tuple[np.ndarray, np.ndarray]:
    """The pair itself, and with the sensor or the light or both off in each of four ways."""
    steps = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]], float)
    ways = [
        [pose] + [shifted(pose, off * step) for step in steps if off > 0]
        for pose, off in ((sensor, tolerances.sensor_deg), (light, tolerances.light_deg))
    ]
    pairs = list(product(*ways))
    return np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])


def _move(plan: Plan, problem: SearchProblem, name: str, by: float) -> Move:
    world = replace(problem, scene=altered(plan.scene, {name: 1 + by}))
    pair = tuple(np.array(list(pose)) for pose in plan.poses)
    here, before = (float(each.values(*(pose[None] for pose in pair))[0]) for each in (world, problem))
    if not np.isfinite(here):
        return Move(name, 1 + by, np.inf, np.inf, np.nan, np.nan)
    there = refine(world, pair, 1.0)
    apart = [
        float(np.degrees(np.arccos(np.clip(direction(a) @ direction(b), -1, 1))))
        for a, b in zip(pair, there[:2], strict=True)
    ]
    return Move(name, 1 + by, here / before, there.value / before, *apart)
