"""The best settings that clearly differ from each other, so that a user has a choice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.imaging.projection import direction
from planner.search.exhaustive import evaluate_pairs
from scenes import Pose

_APART = 15.0  # degrees between two sensors, or two lights, that are clearly different


@dataclass(frozen=True)
class Candidate:
    """A setting worth considering: poses, required edges, its variance in the object and in the image."""

    sensor: Pose
    light: Pose
    edges: tuple[str, ...]
    variance_object: float
    variance_image: float


def candidates(options, results, objective: str, count: int = 10):
    """The best settings whose sensors or lights differ by 15 degrees, over all sets of required edges."""
    rows = []
    for k, result in enumerate(results):
        if result.found is None:
            if np.isfinite(result.variance):
                rows.append((result.variance, k, result.sensor, result.light))
            continue
        order = np.argsort(result.found.least)
        order = order[np.isfinite(result.found.least[order])]
        picked = _spread(direction(options[k].sensors[order]), count)
        for s in order[picked]:
            light = options[k].lights[result.found.best_light[s]]
            rows.append((result.found.least[s], k, options[k].sensors[s], light))
        rows.append((result.variance, k, result.sensor, result.light))
    rows.sort(key=lambda row: row[0])
    chosen: list[tuple] = []
    for row in rows:
        if all(_differ(row, other) for other in chosen):
            chosen.append(row)
    made = [_candidate(options[k], sensor, light) for _, k, sensor, light in chosen[: 2 * count]]
    value = "variance_object" if objective == "object" else "variance_image"
    return tuple(sorted(made, key=lambda c: getattr(c, value))[:count])


def _candidate(option, sensor: np.ndarray, light: np.ndarray) -> Candidate:
    values = [
        float(evaluate_pairs(option.scene, sensor[None], light[None], option.model, units)[0])
        for units in ("object", "image")
    ]
    return Candidate(Pose(*map(float, sensor)), Pose(*map(float, light)), option.scene.task.edges, *values)


def _spread(directions: np.ndarray, count: int) -> list[int]:
    """The first of the directions, then each next one that is far from all before."""
    picked: list[int] = []
    open_ = np.ones(len(directions), bool)
    while open_.any() and len(picked) < count:
        picked.append(int(np.argmax(open_)))
        open_ &= directions @ directions[picked[-1]] < np.cos(np.radians(_APART))
    return picked


def _differ(row: tuple, other: tuple) -> bool:
    """Whether sensors or lights are clearly apart."""
    near = np.cos(np.radians(_APART))
    return any(direction(row[i]) @ direction(other[i]) < near for i in (2, 3))
