"""The best of all sensor x light pairs, by branch and bound where there is a bound."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from imaging.features.projected_edges import circles
from imaging.light.appearance import is_separable
from planner.search.bound import Separable, separable
from planner.search.constraints import Constraints
from planner.search.objective import Aim, Report, SearchProblem, cut_off, minimised
from scenes import Scene

_ROWS = 256  # sensors at a time
_PAIRS = 1 << 16  # pairs evaluated exactly at a time


@dataclass(frozen=True, eq=False)
class BestPair:
    """The best pair of a search.

    Attributes
    ----------
    sensor, light : int
        Indices into the poses searched; -1 where no pair can measure.
    variance : float
        What is minimised (`Aim`).
    pairs : int
        How many pairs were covered, and ...
    evaluated : int
        ... how many of them had to be evaluated one by one; the others are excluded by a lower bound.
    best_light : ndarray of int, shape (S,)
        For each sensor a light that is best or nearly so; -1 where none can measure.
    least : ndarray, shape (S,)
        Lower bound of the variance for each sensor (the variance itself where no bound exists).
    guaranteed : bool
        Whether no other pair of the grid is better, or ...
    within_scale : bool
        ... no other one whose levels the end of the scale does not cut off.
    """

    sensor: int
    light: int
    variance: float
    pairs: int
    evaluated: int
    best_light: np.ndarray
    least: np.ndarray
    guaranteed: bool
    within_scale: bool = False


def has_bound(scene: Scene, model: str) -> bool:
    """Whether the fast search applies: a separable scene, straight edges only."""
    return is_separable(scene) and not circles(scene) and model in ("paper", "calibrated")


def exhaustive(
    scene: Scene, sensors: np.ndarray, lights: np.ndarray, model: str, objective: str | Aim,
    constraints: Constraints | None = None, report: Report | None = None,
) -> BestPair:  # fmt: skip
    """Search all pairs of sensors (S, 2) and lights (L, 2 F), degrees; F lights are free: `best_pair`."""
    return best_pair(
        SearchProblem.of(scene, model, objective, constraints), sensors, lights, report or (lambda *_: None)
    )


def best_pair(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report) -> BestPair:
    """The best of all pairs of sensors (S, 2) and lights (L, 2 F), degrees; F lights are free.

    For a convex diffuse solid a rigorous lower bound of every pair is one matrix product; only pairs whose bound does
    not exceed the best variance known are evaluated. Otherwise every pair is evaluated.
    """
    search = _by_bound if has_bound(problem.scene, problem.model) else _one_by_one
    return search(problem, sensors, lights, report)


def _by_bound(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report) -> BestPair:
    table = separable(problem.scene, sensors, lights, problem.model, problem.objective)
    least, column = np.full(len(sensors), np.inf), np.full(len(sensors), -1)
    done, whole = 0, 2 * len(table.sensors)
    for rows, which, bound in _blocks(table, problem, sensors, lights):
        lowest = bound.argmin(1)
        least[table.sensors[rows]] = bound[np.arange(len(rows)), lowest]
        column[table.sensors[rows]] = which[lowest]
        done += len(rows)
        report("bounding all pairs", done, whole)
    column[~np.isfinite(least)] = -1
    order = np.argsort(least)[: max(256, len(least) // 64)]
    order = order[np.isfinite(least[order])]
    best = _better(_NONE, order, column[order], problem.values(sensors[order], lights[column[order]]))
    evaluated = len(order)
    for rows, which, bound in _blocks(table, problem, sensors, lights, least <= best[0]):
        hit = np.argwhere(bound <= best[0])
        for at in range(0, len(hit), _PAIRS):
            some = hit[at : at + _PAIRS]
            s, k = table.sensors[rows[some[:, 0]]], which[some[:, 1]]
            best = _better(best, s, k, problem.values(sensors[s], lights[k]))
        evaluated += len(hit)
        done += len(rows)
        report("evaluating what is left", done, whole)
    variance, *pair = best
    return BestPair(*pair, variance, len(sensors) * len(lights), evaluated, column, least, guaranteed=True)


def _blocks(
    table: Separable, problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, wanted: np.ndarray | None = None
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Blocks (rows into table.sensors, indices of lights, bounds) of all pairs, or of the wanted sensors only."""
    for which in range(len(table.strength)):
        rows, columns, matrix = table.of_class(which)
        if wanted is not None:
            rows = rows[wanted[table.sensors[rows]]]
        if not len(columns):
            continue
        for at in range(0, len(rows), _ROWS):
            block = rows[at : at + _ROWS]
            allowed = problem.feasible(sensors[table.sensors[block]][:, None], lights[columns][None])
            bound = table.rows(block, matrix)
            yield block, columns, bound if allowed.ndim == 0 else np.where(allowed, bound, np.inf)


def _one_by_one(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report) -> BestPair:
    least, column = (np.full((2, len(sensors)), value) for value in (np.inf, -1))  # of all pairs, and of those within
    for part, errors, allowed in problem.table(sensors, lights, report):
        values = np.where(allowed, minimised(errors, problem.objective), np.inf)
        for k, some in enumerate((values, np.where(cut_off(errors, problem.scene), np.inf, values))):
            column[k, part] = some.argmin(1)
            least[k, part] = some.min(1)
    within = bool(np.isfinite(least[1]).any())
    spared = within and bool((least[1] > least[0]).any())
    column, least = column[int(within)].astype(int), least[int(within)]
    column[~np.isfinite(least)] = -1
    variance, *pair = _better(_NONE, np.arange(len(sensors)), column, least)
    pairs = len(sensors) * len(lights)
    return BestPair(*pair, variance, pairs, pairs, column, least, guaranteed=True, within_scale=spared)


_NONE = np.inf, -1, -1


def _better(best: tuple[float, int, int], sensors: np.ndarray, lights: np.ndarray, values: np.ndarray):
    """The best pair known (value, sensor, light), or the best of some others where that is better."""
    if not len(values) or not values.min() < best[0]:
        return best
    k = int(values.argmin())
    return float(values[k]), int(sensors[k]), int(lights[k])
