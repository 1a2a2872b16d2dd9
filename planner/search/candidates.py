"""The best settings that clearly differ from each other, and the best of them whose measurands can be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from imaging.geometry.projection import direction
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.prediction import minimised, predict
from planner.search.grid import as_array, as_poses
from planner.search.objective import Aim
from scenes import Picture, Pose, Scene
from scenes.status import is_trusted

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


DEAREST = 4.0  # times the least variance that is paid for it: standard deviations are twice as large


class Trusted(NamedTuple):
    """The setting that is taken, how many of its measurands are not ``ok``, and the better ones that are not taken."""

    sensor: np.ndarray
    light: np.ndarray
    untrusted: int
    set_aside: tuple[Candidate, ...]


def trusted(
    scene: Scene, best: tuple[np.ndarray, np.ndarray], variance: float, choice: Sequence[Candidate], model: str
) -> Trusted:
    """The best setting with the fewest measurands that are not ``ok``.

    Parameters
    ----------
    best : pair of ndarray, shape (2,) and (2 F,)
        Sensor and lights of the least variance.
    variance : float
        What was minimised, there.
    choice : sequence of Candidate
        The others, the best first.
    """
    least, passed = Trusted(*best, untrusted(scene, *best, model), ()), []
    for candidate in choice:
        if least.untrusted == 0 or candidate.variance > DEAREST * variance:
            break
        if candidate.edges != scene.required:
            continue
        poses = np.array(list(candidate.sensor)), as_array(candidate.light)
        if all(np.allclose(pose, own) for pose, own in zip(poses, best, strict=True)):
            passed.append(candidate)
            continue
        wrong = untrusted(scene, *poses, model)
        if wrong < least.untrusted:
            least = Trusted(*poses, wrong, tuple(passed))
        passed.append(candidate)
    return least


def untrusted(scene: Scene, sensor: np.ndarray, light: np.ndarray, model: str) -> int:
    """How many measurands of a setting are not ``ok``."""
    told = predict(scene, tuple(map(float, sensor)), as_poses(light), model)
    return sum(not is_trusted(each.status) for each in told.measurands)
