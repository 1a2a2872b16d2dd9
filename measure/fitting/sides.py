"""Where a likelihood is flat on one side of its maximum: light or a line of sight that just grazes a face."""

from __future__ import annotations

import numpy as np

from imaging.geometry.projection import facing, viewpoint
from measure.fitting.information import covariance_of
from measure.fitting.likelihood import Problem, most_likely
from scenes import Noise

_FAR = 6.0  # standard errors from the maximum, where the likelihood is looked at
_FLAT = 0.25  # of what squared residuals are to grow by there: three true standard errors are there or beyond
_ROUNDS = 6
_LEVELS = ("camera.exposure", "noise.dark_level")  # that make up the grey levels of faces, beside lights


def flatter_side(
    problem: Problem, values: np.ndarray, noise: Noise, which: np.ndarray, white: np.ndarray, variance: np.ndarray
) -> np.ndarray:
    """Values (q,) at which the information is that of the flatter side of a bent likelihood; else the maximum.

    A face that light just grazes tells where the light is by what it would gain from it, but not how far behind the
    face it may be: dark is dark. So does a face seen edge-on. Each angle of a light is moved by 6 standard errors to
    both sides, and what else makes up the faces' levels is sought anew; each angle of a sensor too, where a face comes
    into sight or goes out of it by that, and everything is sought anew. Squared residuals must grow by 36; where they
    grow by less than 9, the error is at least twice too small. It is then taken there, and the same asked that much
    farther away.
    """
    free = problem.parameters.free
    levels = np.array([i for i in which if free[i].kind == "light" or free[i].name in _LEVELS], int)
    found, worst = values, 1.0
    for i in which[[free[i].kind in ("light", "sensor") for i in which]]:
        if free[i].kind == "sensor" and not _turns_away(problem, values, i, which, white):
            continue
        others = np.setdiff1d(levels if free[i].kind == "light" else which, i)
        for side in (-1.0, 1.0):
            at, ratio = _followed(problem, values, noise, which, white, variance, (i, side, others))
            if ratio > worst:
                found, worst = at, ratio
    return found


def _turns_away(problem: Problem, values: np.ndarray, i: int, which: np.ndarray, white: np.ndarray) -> bool:
    """Whether a sensor sees other faces so many standard errors away, all parameters moving in a straight line."""
    parameters, covariance = problem.parameters, covariance_of(white)
    k, column = parameters.free[i].where[0], int(np.flatnonzero(which == i)[0])
    step = np.zeros(values.size)
    step[which] = _FAR * covariance[:, column] / np.sqrt(covariance[column, column])
    seen = []
    for there in (values - step, values, values + step):
        scene, (sensor, _) = parameters.scene_at(there), parameters.poses_at(there, k)
        seen.append(facing(scene.solid, viewpoint(scene.camera, sensor)))
    return bool(np.not_equal(seen, seen[1]).any())


def _followed(problem, values, noise, which, white, variance, way) -> tuple[np.ndarray, float]:
    """Where one side of one parameter is flat, and how many times larger than at the maximum its error is there."""
    (i, side, others), sigma, observed = way, np.sqrt(variance), problem.observed()
    free, column = problem.parameters.free[i], int(np.flatnonzero(which == i)[0])

    def misfit(there: np.ndarray) -> float:
        return float(np.sum(((observed - problem.expected(there, noise)) / sigma) ** 2))

    best, covariance = misfit(values), covariance_of(white)
    error = first = float(np.sqrt(covariance[column, column]))
    at = values
    for _ in range(_ROUNDS):
        there = values.copy()
        there[i] = np.clip(values[i] + side * _FAR * error, free.low, free.high)
        there = most_likely(problem, there, noise, others, variance, nearly=True)
        if misfit(there) - best >= _FLAT * _FAR**2:
            break
        beside = covariance_of(problem.jacobian(there, noise, which) / sigma[:, None])
        farther = float(np.sqrt(beside[column, column]))
        if farther <= error:
            break
        at, error = there, farther
        if error >= free.known:
            break
    return at, error / first
