"""Downhill in two poses and any number of angles, without leaving what can be trusted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.search.refinement import shifted

Point = tuple[np.ndarray, np.ndarray, np.ndarray]
_MOST = 100  # evaluations of each simplex


def descend(
    begin: Point,
    free: tuple[bool, bool],
    value: Callable[[np.ndarray, np.ndarray, np.ndarray], float],
    trust: Callable[[np.ndarray, np.ndarray, np.ndarray], bool],
    sizes: tuple[float, ...],
    *,
    one_mount: bool = False,
) -> Point:
    """Nelder-Mead in the tangent planes of the free poses and in further angles.

    Parameters
    ----------
    begin : (sensor, light, angles)
        Poses (2,) and angles (k,), degrees.
    free : pair of bool
        Whether the sensor and the light may move.
    value : callable
        What is minimised; infinite where it is not allowed.
    trust : callable
        Whether a point counts; asked only of points that would be the best so far, for it takes long.
    sizes : tuple of float
        Of the simplices, one after the other, degrees.
    one_mount : bool
        Whether the light stands where the sensor does.

    Returns
    -------
    sensor, light, angles
        Not worse than at the beginning.
    """
    ends = np.cumsum([2 * free[0], 2 * (free[1] and not one_mount), len(begin[2])])

    def at(x: np.ndarray) -> Point:
        moves = x[: ends[0]], x[ends[0] : ends[1]], x[ends[1] :]
        poses = [shifted(p, move) if len(move) else p for p, move in zip(begin[:2], moves[:2], strict=True)]
        return poses[0], poses[0] if one_mount and free[0] else poses[1], begin[2] + moves[2]

    least = unit = value(*begin)
    if not ends[-1] or not np.isfinite(unit):
        return begin

    def cost(x: np.ndarray) -> float:
        nonlocal least
        found = value(*at(x))
        if found < least:
            if not trust(*at(x)):
                return np.finfo(float).max
            least = found
        return min(found / unit, np.finfo(float).max)

    from scipy.optimize import minimize  # slow to load, and rarely needed

    x, lowest = np.zeros(ends[-1]), 1.0
    for size in sizes:
        simplex = x + size * np.vstack([np.zeros(len(x)), np.eye(len(x))])
        options = {"initial_simplex": simplex, "xatol": 0.01, "fatol": 1e-5, "maxfev": _MOST}
        found = minimize(cost, x, method="Nelder-Mead", options=options)
        if found.fun < lowest:
            x, lowest = found.x, found.fun
    return at(x)
