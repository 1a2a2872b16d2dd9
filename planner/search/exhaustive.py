"""The best of all sensor x light pairs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from imaging.features.projected_edges import circles
from imaging.light.appearance import is_separable
from imaging.models import variance_model
from imaging.models.errors import Errors
from imaging.pictures import Pictures
from planner.prediction import minimised
from planner.search.bound import Separable, separable
from planner.search.constraints import Constraints
from planner.search.grid import by_light
from planner.search.objective import Aim
from scenes import Scene

_ROWS = 256  # sensors at a time
_UNCUT = 0.98  # of the noise's variance in darkness: below, the end of the scale has cut it off
_PAIRS = 1 << 16  # pairs evaluated exactly at a time

Report = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Found:
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
) -> Found:  # fmt: skip
    """Search all pairs of sensors (S, 2) and lights (L, 2 F), degrees; F lights are free.

    For a convex diffuse solid a rigorous lower bound of every pair is one matrix product; only pairs whose bound does
    not exceed the best variance known are evaluated. Otherwise every pair is evaluated.
    """
    search = _by_bound if has_bound(scene, model) else _one_by_one
    return search(scene, sensors, lights, model, objective, constraints, report or (lambda *_: None))


def cut_off(errors: Errors, scene: Scene) -> np.ndarray:
    """In which pictures (...) the end of the scale has cut off levels of an edge.

    What is cut off scatters less, so that a plain minimum is led to where every measurement is biased.
    """
    return (errors.noise_variance < _UNCUT * scene.noise.variance).any(-1)


def evaluate_pairs(scene: Scene, sensors, lights, model: str, objective: str | Aim) -> np.ndarray:
    """What is minimised of pairs (n, 2), (n, 2 F), in chunks."""
    values = np.empty(len(sensors))
    size = _PAIRS // 8
    for at in range(0, len(sensors), size):
        part = slice(at, at + size)
        values[part] = minimised(
            variance_model(model)(Pictures.of(scene, sensors[part], by_light(lights[part]))), objective
        )
    return values


def _by_bound(scene, sensors, lights, model, objective, constraints, report) -> Found:
    table = separable(scene, sensors, lights, model, Aim.of(scene.quantities, objective))
    least, best = np.full(len(sensors), np.inf), np.full(len(sensors), -1)
    done = 0
    for rows, which, bound in _blocks(table, scene, sensors, lights, constraints):
        column = bound.argmin(1)
        least[table.sensors[rows]] = bound[np.arange(len(rows)), column]
        best[table.sensors[rows]] = which[column]
        done += len(rows)
        report("bounds", done, 2 * len(table.sensors))
    best[~np.isfinite(least)] = -1
    order = np.argsort(least)[: max(256, len(least) // 64)]
    order = order[np.isfinite(least[order])]
    values = evaluate_pairs(scene, sensors[order], lights[best[order]], model, objective)
    state = _Best.of(order, best[order], values)
    evaluated = len(order)
    wanted = least <= state.variance
    for rows, which, bound in _blocks(table, scene, sensors, lights, constraints, wanted):
        hit = np.argwhere(bound <= state.variance)
        for at in range(0, len(hit), _PAIRS):
            some = hit[at : at + _PAIRS]
            s, k = table.sensors[rows[some[:, 0]]], which[some[:, 1]]
            state = state.better(s, k, evaluate_pairs(scene, sensors[s], lights[k], model, objective))
        evaluated += len(hit)
        done += len(rows)
        report("exact", done, 2 * len(table.sensors))
    return Found(
        state.sensor, state.light, state.variance, len(sensors) * len(lights), evaluated, best, least, guaranteed=True
    )


def _blocks(table: Separable, scene, sensors, lights, constraints, wanted=None):
    """Blocks (rows into table.sensors, indices of lights, bounds) of all pairs, or of the wanted sensors only."""
    for which in range(len(table.strength)):
        rows, columns, matrix = table.of_class(which)
        if wanted is not None:
            rows = rows[wanted[table.sensors[rows]]]
        if not len(columns):
            continue
        for at in range(0, len(rows), _ROWS):
            block = rows[at : at + _ROWS]
            bound = table.rows(block, matrix)
            if constraints is not None and constraints.on_pairs:
                allowed = constraints.pairs(scene, sensors[table.sensors[block]][:, None], lights[columns][None])
                bound = np.where(allowed, bound, np.inf)
            yield block, columns, bound


def _one_by_one(scene, sensors, lights, model, objective, constraints, report) -> Found:
    least, best = (np.full((2, len(sensors)), value) for value in (np.inf, -1))  # of all pairs, and of those within
    evaluate = variance_model(model)
    size = max(1, 20_000 // max(len(lights), 1))
    for at in range(0, len(sensors), size):
        part = sensors[at : at + size]
        errors = evaluate(Pictures.of(scene, part[:, None], by_light(lights[None])))
        values = minimised(errors, objective)
        if constraints is not None and constraints.on_pairs:
            values = np.where(constraints.pairs(scene, part[:, None], lights[None]), values, np.inf)
        for k, some in enumerate((values, np.where(cut_off(errors, scene), np.inf, values))):
            best[k, at : at + size] = some.argmin(1)
            least[k, at : at + size] = some.min(1)
        report("pairs", min(at + size, len(sensors)), len(sensors))
    within = bool(np.isfinite(least[1]).any())
    spared = within and bool((least[1] > least[0]).any())
    best, least = best[int(within)].astype(int), least[int(within)]
    best[~np.isfinite(least)] = -1
    state = _Best.of(np.arange(len(sensors)), best, least)
    pairs = len(sensors) * len(lights)
    found = state.sensor, state.light, state.variance, pairs, pairs, best, least
    return Found(*found, guaranteed=True, within_scale=spared)


@dataclass(frozen=True)
class _Best:
    sensor: int
    light: int
    variance: float

    @classmethod
    def of(cls, sensors: np.ndarray, lights: np.ndarray, values: np.ndarray) -> _Best:
        return cls(-1, -1, np.inf).better(sensors, lights, values)

    def better(self, sensors: np.ndarray, lights: np.ndarray, values: np.ndarray) -> _Best:
        """The better of this pair and some others."""
        if not len(values) or not values.min() < self.variance:
            return self
        k = int(values.argmin())
        return _Best(int(sensors[k]), int(lights[k]), float(values[k]))
