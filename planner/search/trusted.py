"""The best setting whose measurands can be trusted: a close look at those that a search proposes.

A search minimises variances. Bias, and what is too near for either to be told, are known of a single picture only
(`planner.predict`): of the clearly different settings the best is taken in which nothing is `clutter`, as long as it
does not cost too much.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.prediction import predict
from planner.search.candidates import Candidate
from planner.search.poses import as_array, as_poses
from scenes import Scene
from scenes.status import is_trusted

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
