"""Scenes with a distance that has a tolerance, drawn convex parts, and U at poses by what shares nothing with cells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy import stats

import planner
import scenes
from imaging.pictures import Pictures
from planner.budgeting.budgets import shared_inputs
from planner.budgeting.features import Features
from planner.budgeting.sensitivities import sensitivities
from planner.budgeting.sources import sources
from scenes import Picture, Scene
from scenes.parts.mesh import read


def toleranced(name: str, tolerance: float, **changes: Any) -> Scene:
    """A bundled scene's task as a measurand with a tolerance, cm."""
    scene = scenes.load(name)
    features = [{"vertex": corner.vertex, "edges": list(corner.edges)} for corner in scene.task.corners]
    return scene.with_(task=None, measurands=[_asked(features, tolerance)], **changes)


def drawn_part(folder: Path, seed: int, tolerance: float) -> Scene:
    """A frustum over a drawn polygon, of which the distance of two drawn corners of the upper face is measured."""
    draws = np.random.default_rng(seed)
    turns = np.linspace(0, 2 * np.pi, int(draws.integers(4, 7)), endpoint=False)
    turns = turns + draws.uniform(-0.25, 0.25, len(turns))
    ring = 5.5 * np.column_stack([np.cos(turns), np.sin(turns)])
    height, less = draws.uniform(2, 3), draws.uniform(0.7, 0.9)
    corners = np.concatenate([np.c_[ring, np.zeros(len(ring))], np.c_[less * ring, np.full(len(ring), height)]])
    path = folder / f"drawn{seed}.stl"
    trimesh.convex.convex_hull(corners).export(path)
    solid = read(path, unit="cm")
    top = {k for k, at in enumerate(solid.vertices) if at[2] > height - 1e-3}
    features = [
        {"vertex": solid.vertex_names[one], "edges": [e.name for e in solid.meeting[one] if set(e.ends) <= top]}
        for one in map(int, draws.choice(sorted(top), 2, replace=False))
    ]
    return Scene.model_validate({
        "name": f"drawn{seed}", "object": {"kind": "mesh", "units": "cm", "file": str(path)},
        "material": {"diffuse_reflectance": 0.9},
        "camera": {"width": 256, "height": 240, "focal_px": 800.0, "distance": 100.0, "blur_px": 0.6,
                   "exposure": 200.0},
        "light": {"distance": 100.0}, "noise": {"dark_level": 20.0, "sigma": 2.4, "bits": 8},
        "measurands": [_asked(features, tolerance)],
    })  # fmt: skip


def _asked(features: list[dict], tolerance: float) -> dict:
    return {"name": "length", "kind": "distance", "features": features, "tolerance": tolerance}


def expanded(scene: Scene, sensors: np.ndarray, lights: np.ndarray, p: float = 0.95) -> np.ndarray:
    """U (n,) of a scene's one length, whose inputs are all of infinite degrees of freedom and independent: the
    calibrated variance, a largest error of 0.3 sigma, and the inputs by the budget's differences."""
    given, variance = sources(scene), planner.variances(scene, sensors, lights) * (1 + 0.3**2 / 3)
    u = np.array([each.told.u for each in given])
    assert len(shared_inputs(scene, given)) == len(given)
    if len(given):
        for k, poses in enumerate(zip(sensors, lights, strict=True)):
            features = Features(Pictures.of(Picture.of(scene, *poses)))
            variance[k] += ((sensitivities(features, given, biased=False)[0] * u) ** 2).sum()
    variance += (scene.uncertainty.rounding / 2) ** 2 / 3
    return stats.norm.ppf((1 + p) / 2) * np.sqrt(variance)
