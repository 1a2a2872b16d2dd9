"""Scenes in which things hide and shade each other, and pairs of poses, drawn for bounds of their variances."""

from __future__ import annotations

import numpy as np

import scenes
from planner.search.objective import Aim, SearchProblem
from scenes import Floor

NAMES = "bracket", "grey_floor", "plate", "bracket_mm", "wedge", "two_lights"


def drawn_problem(rng: np.random.Generator, names: tuple[str, ...] = NAMES) -> SearchProblem:
    """A bundled scene, some with shot noise, a floor, a second light, another locator or other aims."""
    scene = scenes.load(str(rng.choice(names)))
    if rng.random() < 0.3:
        scene = scene.with_(noise={"gain": float(rng.uniform(0.02, 0.3))})
    if rng.random() < 0.3:
        low = float(scene.solid.vertices[:, 2].min())
        scene = scene.with_(floor=Floor(reflectance=float(rng.uniform(0.05, 0.8)), height=low))
    if rng.random() < 0.3 and len(scene.lights) == 1:
        lamp = {"distance": scene.light.distance}
        other = {"mount": "fixed", "pose": [float(rng.uniform(10, 60)), float(rng.uniform(0, 360))]}
        both = [lamp | {"intensity": 0.7}, lamp | {"intensity": 0.3} | other]
        scene = scene.with_(light=None, lights=both)
    if rng.random() < 0.3:
        scene = scene.with_(locator={"scale_px": float(rng.uniform(1.0, 2.0))})
    several = len(scene.quantities) > 1
    aim = Aim.of(scene.quantities, "object" if several or rng.random() < 0.5 else "image",
                 "sum" if several and rng.random() < 0.5 else "minimax")  # fmt: skip
    return SearchProblem(scene, "calibrated", aim)


def drawn_poses(rng: np.random.Generator, count: int) -> np.ndarray:
    """Evenly over the upper hemisphere, degrees, (count, 2)."""
    return np.column_stack([np.degrees(np.arccos(rng.uniform(0.05, 1, count))), rng.uniform(0, 360, count)])


def drawn_lights(rng: np.random.Generator, problem: SearchProblem, count: int) -> np.ndarray:
    """Of all free lights, (count, 2 F)."""
    return np.concatenate([drawn_poses(rng, count) for _ in problem.scene.free], 1)


def all_values(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """What is minimised of all pairs of sensors (S, 2) and lights (L, 2 F), (S, L)."""
    s, k = (part.ravel() for part in np.indices((len(sensors), len(lights))))
    return problem.values(sensors[s], lights[k]).reshape(len(sensors), len(lights))
