"""What a plan minimises, pair by pair."""

from __future__ import annotations

import numpy as np

from planner.search.objective import Aim, SearchProblem
from scenes import Scene


def evaluate_pairs(
    scene: Scene, sensors: np.ndarray, lights: np.ndarray, model: str, objective: str | Aim
) -> np.ndarray:
    """Of sensors (n, 2) and lights (n, 2), degrees, by fast evaluation, whatever the constraints; shape (n,)."""
    return SearchProblem.of(scene, model, objective).values(sensors, lights)
