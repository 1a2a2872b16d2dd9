"""Scenes in which things hide and shade each other, and pairs of poses, drawn for bounds of their variances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import scenes
from planner.search.objective import Aim, SearchProblem, cut_off, minimised
from scenes import Floor, Scene

_ENDLESS = 30  # bits
NAMES = "bracket", "grey_floor", "plate", "bracket_mm", "wedge", "two_lights"


def drawn_problem(rng: np.random.Generator, names: tuple[str, ...] = NAMES) -> SearchProblem:
    """A bundled scene, some with shot noise, a floor, a second light, another locator, gloss or other aims."""
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
    if rng.random() < 0.4:
        scene = _glossy(scene, rng)
    several = len(scene.quantities) > 1
    aim = Aim.of(scene.quantities, "object" if several or rng.random() < 0.5 else "image",
                 "sum" if several and rng.random() < 0.5 else "minimax")  # fmt: skip
    return SearchProblem(scene, "calibrated", aim)


def _glossy(scene: Scene, rng: np.random.Generator) -> Scene:
    """Of a dull or bright metal or a dielectric, some between polarisers."""
    index = (rng.uniform(0.2, 2), rng.uniform(1, 7)) if rng.random() < 0.5 else (rng.uniform(1.3, 2), 0.0)
    surface = dict(zip(("refractive_index", "extinction"), map(float, index), strict=True))
    surface |= {"specular_fraction": float(rng.uniform(0.1, 0.9)), "roughness": float(10 ** rng.uniform(-1.5, 0.1))}
    scene = scene.with_(material=surface | {"diffuse_reflectance": float(rng.uniform(0.1, 0.9))})
    if rng.random() < 0.3:
        scene = scene.with_(camera={"analyser_deg": float(rng.uniform(0, 180))})
    if rng.random() < 0.3 and len(scene.lights) == 1:
        scene = scene.with_(light={"polarisation_deg": float(rng.uniform(0, 180))})
    return scene


def drawn_poses(rng: np.random.Generator, count: int) -> np.ndarray:
    """Evenly over the upper hemisphere, degrees, (count, 2)."""
    return np.column_stack([np.degrees(np.arccos(rng.uniform(0.05, 1, count))), rng.uniform(0, 360, count)])


def drawn_lights(rng: np.random.Generator, problem: SearchProblem, count: int) -> np.ndarray:
    """Of all free lights, (count, 2 F)."""
    return np.concatenate([drawn_poses(rng, count) for _ in problem.scene.free], 1)


def all_values(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """What is minimised of all pairs of sensors (S, 2) and lights (L, 2 F), (S, L)."""
    return minimised(problem.errors(sensors[:, None], lights[None]), problem.objective)


def searched_values(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """The same, infinite where the search takes levels to be cut off at the end of the scale, if any pair is left."""
    values = all_values(problem, sensors, lights)
    cut = cut_off(problem.errors(sensors[:, None], lights[None]))
    within = np.where(cut, np.inf, values)
    return within if np.isfinite(within).any() else values


def values_within(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """The values of all pairs by which no level is cut off, NaN of the others: those of a sensor without an end."""
    values = all_values(problem, sensors, lights)
    endless = replace(problem, scene=problem.scene.tried(noise=problem.scene.noise.tried(bits=_ENDLESS)))
    return np.where(values == all_values(endless, sensors, lights), values, np.nan)
