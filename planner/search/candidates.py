"""The best settings that clearly differ from each other, so that a user has a choice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.geometry.projection import direction
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.prediction import minimised
from planner.search.aim import Aim
from planner.search.poses import as_poses
from scenes import Picture, Pose

_APART = 15.0  # degrees between two sensors, or two lights, that are clearly different


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


def candidates(options, results, aim: Aim, count: int = 10):
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
    made = [_candidate(options[k], sensor, light, aim) for _, k, sensor, light in chosen[: 2 * count]]
    return tuple(sorted(made, key=lambda c: c.variance)[:count])


def _candidate(option, sensor: np.ndarray, light: np.ndarray, aim: Aim) -> Candidate:
    poses = Pose(*map(float, sensor)), as_poses(light)
    found = variance_model(option.model)(Pictures.of(Picture.of(option.scene, *poses)))
    worst = int(np.argmax(found.variances_object * aim.shares))
    return Candidate(
        *poses,
        option.scene.required,
        float(found.variances_object[worst]),
        float(found.variances[worst]),
        float(minimised(found, aim)),
        option.scene.quantities[worst].name,
    )


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
    pairs = zip(_each(row), _each(other), strict=True)
    return any(direction(one) @ direction(two) < near for one, two in pairs)


def _each(row: tuple) -> np.ndarray:
    """Poses of sensor and lights, (1 + F, 2)."""
    return np.concatenate([row[2], row[3]]).reshape(-1, 2)
