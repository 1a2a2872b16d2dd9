"""Several pictures that are adjusted together (network design): where sensor and light stand for each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from imaging.bundles.unknowns import Axes, Cameras, Freedom, Sensors, Shape
from imaging.models import DEFAULT_MODEL, ModelName
from planner.budgeting.bundles import budgets_of
from planner.bundles import BundlePrediction, predict_bundle
from planner.constraints import Constraints
from planner.planning import COARSE_STEP
from planner.search.candidates import DEAREST, STEEPEST
from planner.search.grid import Grid
from planner.search.network_pool import NetworkPool
from planner.search.networks import best_of_all, best_sets
from planner.search.objective import DEFAULT_OVER, Aim, Over, Report, SearchProblem
from planner.search.pool import settings_of
from planner.views import MOST_VIEWS
from scenes import InvalidInput, Picture, Scene, status
from scenes.results import Shown, finite, poses

_MOST_SENSORS = 4000  # that a grid may have
_COUNTS = {status.OK: 1.0, status.CLUTTER: DEAREST}  # times a variance, in what is minimised
_MOST_COMBINATIONS = 256  # of places of several lights
_LOOKED = 8  # settings for each picture of a set that are ray-traced at most


@dataclass(frozen=True, eq=False)
class BundleSet:
    """The best K pictures that were found; one may be there several times.

    Attributes
    ----------
    pictures : tuple of Picture
    sensors : {"known", "uncertain", "unknown"}
        What is known of where they stand.
    prediction : BundlePrediction
        Of them adjusted together, looked at closely.
    minimised : float or None
        Largest squared ratio of standard uncertainty to tolerance, or the weighted sum, of what is told (of a single
        quantity its variance); what is ``clutter`` counts as four times its variance. None where
        the pictures leave a quantity open.
    searched : float or None
        The same by the search's own variances of lines and circles, with which the next two compare.
    exhaustive : float or None
        That of the best of all sets of K of the settings that were looked at; None where they are too many.
    bound : float or None
        What no K pictures of the grid can stay below, if a glance is right; None where no pictures, however many, tell
        every quantity, or K do not, and of several free lights.
    impossible : bool
        Whether no K pictures of the grid tell every quantity, by a glance at all sets of them.
    hard : tuple of str
        Names of the quantities that are not told, or with four times the variance, without what is not seen of each
        picture around its poses (`planner.search.candidates`): they are hard to set up.
    """

    pictures: tuple[Picture, ...]
    sensors: Sensors
    prediction: BundlePrediction
    minimised: float | None
    searched: float | None
    exhaustive: float | None
    bound: float | None
    impossible: bool
    hard: tuple[str, ...]

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the quantities that the pictures do not tell."""
        told = zip(self.prediction.quantities, self.prediction.status, strict=True)
        return tuple(quantity.name for quantity, state in told if state not in _COUNTS)

    @property
    def is_plan(self) -> bool:
        """Whether every quantity is told."""
        return not self.lost

    @cached_property
    def U(self) -> np.ndarray:  # noqa: N802 (the GUM's)
        """Expanded uncertainties (M,), 95 %, by all that the scene says; NaN of what is not told."""
        by_name = {each.name: each.U for each in budgets_of(self.prediction, self.sensors)}
        return np.array([by_name.get(quantity.name, math.nan) for quantity in self.prediction.quantities])

    @property
    def ratios(self) -> np.ndarray:
        """Standard uncertainty over tolerance (half of the zone), (M,); NaN of what is not told or has none."""
        told = zip(self.prediction.quantities, self.prediction.u, strict=True)
        return np.array([u / q.tolerance.half if q.tolerance and u < math.inf else math.nan for q, u in told])

    @property
    def worst_ratio(self) -> float | None:
        """The largest; None where there is none."""
        return None if self.limiting is None else float(np.nanmax(self.ratios))

    @property
    def limiting(self) -> str | None:
        """Name of that quantity."""
        ratios = self.ratios
        return None if np.isnan(ratios).all() else self.prediction.quantities[int(np.nanargmax(ratios))].name

    @property
    def gap(self) -> float | None:
        """``searched`` over ``bound``, less 1: at most so much is lost to the best pictures of the grid; None where
        there is no bound or no plan."""
        return self.searched / self.bound - 1 if self.bound and self.searched else None


@dataclass(frozen=True, eq=False, repr=False)
class BundlePlan(Shown):
    """For 1, 2, ... N pictures that are adjusted together the best ones, and how they were found.

    Attributes
    ----------
    scene : Scene
    over, model : str
    sensors : {"known", "uncertain", "unknown"}
        What is known before of where they stand.
    sets : tuple of BundleSet
        One for each number of pictures.
    pairs : int
        Pairs of the grid.
    looked : int
        Settings looked at closely.
    guarantee : str
        What is known about the optimum.
    """

    scene: Scene
    over: str
    model: str
    sensors: Sensors
    sets: tuple[BundleSet, ...]
    pairs: int
    looked: int
    guarantee: str

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a set, picture and quantity: poses, and what all of them tell together."""
        return [row for each in self.sets for row in self._rows(each)]

    def _rows(self, found: BundleSet) -> Iterator[dict[str, Any]]:
        for number, picture in enumerate(found.pictures, 1):
            for row, U in zip(found.prediction.as_rows(), found.U, strict=True):
                about = {"scene": row["scene"], "pictures": row["pictures"], "picture": number}
                told = {name: row[name] for name in ("name", "unit", "sigma", "u", "status")}
                yield about | poses(picture.sensor, picture.free_lights) | told | {"U": finite(U)}

    def _line(self) -> str:
        last = self.sets[-1]
        worst = "" if last.worst_ratio is None else f", u up to {last.worst_ratio:.3g} of its tolerance"
        lost = "" if last.is_plan else f", no plan of {', '.join(last.lost)}"
        return f"{self.scene.name}: {len(last.pictures)} pictures adjusted together{worst}{lost}"


def plan_bundle(
    scene: Scene,
    count: int,
    sensors: Sensors = "uncertain",
    *,
    shape: Shape = "in_space",
    axes: Axes = "known",
    cameras: Cameras = "one",
    over: Over = DEFAULT_OVER,
    model: ModelName = DEFAULT_MODEL,
    step_deg: float | None = None,
    constraints: Constraints | None = None,
    sensor: Any = None,
    light: Any = None,
    report: Report | None = None,
) -> BundlePlan:
    """Find ``count`` pictures, each of one sensor and light, that measure all quantities best, adjusted together.

    What is minimised is what `plan` minimises, of the squared standard uncertainties u that `predict_bundle` tells: by
    noise, and by all that is not known before of part, sensors and camera.

    Each setting of a grid is a matrix, its information of what pictures share (`planner.search.networks`); of each
    sensor two lights are candidates, of several free lights two of the places that are best from any sensor for all
    quantities or for one (without a bound). Sets are chosen greedily with exchange, each picture that is chosen gets
    the best of all lights beside the others and is ray-traced (clutter, light between surfaces), and sets are chosen
    again, until all that is chosen has been looked at. The search takes lines as the model has them, edge by edge; what
    is returned is predicted by `predict_bundle`, by the ``calibrated`` model as the estimator has them that is taken.

    Parameters
    ----------
    scene : Scene
    count : int
        1 to 12.
    sensors, shape, axes, cameras
        What is not known before, as of `predict_bundle`.
    over, model, constraints, sensor, light
        As of `plan`.
    step_deg : float, optional
        Grid step; by default 10 degrees.

    Raises
    ------
    InvalidInput
        If an argument is none of its choices, or no allowed setting shows anything.

    Examples
    --------
    >>> import scenes
    >>> found = plan_bundle(scenes.load("task1"), 2, "known", step_deg=30)
    >>> [each.is_plan for each in found.sets]  # a length in space
    [False, True]
    """
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_VIEWS:
        raise InvalidInput(f"views must be 1 to {MOST_VIEWS}, got {count}")
    if model not in ("calibrated", "paper"):
        raise InvalidInput(f"model must be one of calibrated, paper for several pictures, got {model!r}")
    freedom, report = Freedom(sensors, shape, axes, cameras), report or (lambda *_: None)
    problem = SearchProblem(scene, model, Aim.of(scene.quantities, "object", over),
                            (constraints or Constraints()).on_side_of(scene))  # fmt: skip
    step = COARSE_STEP if step_deg is None else step_deg
    grid = Grid.of(scene, problem.constraints, step, sensor, light)
    if len(grid.sensors) > _MOST_SENSORS:
        raise InvalidInput(f"step must leave at most {_MOST_SENSORS} sensors, got {step:g} ({len(grid.sensors)})")
    if is_mixed := len(scene.free) > 1 and not grid.held[1]:
        grid = replace(grid, lights=_combinations(problem, grid, report))
    pool = NetworkPool(problem, freedom, grid, report)
    if not pool.poses:
        raise InvalidInput("constraints must leave a setting that can measure, got none")
    _look(pool, count, report)
    sets = _sets(pool, count, bounded=not is_mixed)
    pairs = len(grid.sensors) * len(grid.lights)
    return BundlePlan(scene, over, model, sensors, sets, pairs, len(pool.looked), _guarantee(step, is_mixed))


def _look(pool: NetworkPool, count: int, report: Report) -> None:
    """Choose, look closely at what is chosen and choose again, until nothing new is chosen or 8 a picture were."""
    most = _LOOKED * count
    while len(pool.looked) < most:
        fresh = []
        for members in best_sets(pool.network(), count):
            fresh += [pool.lit(row, members[:i] + members[i + 1 :]) for i, row in enumerate(members)]
        fresh = [row for row in dict.fromkeys(fresh) if row not in pool.looked]
        if not fresh:
            return
        for row in fresh[: most - len(pool.looked)]:
            pool.look(row)
            report("looking closely", len(pool.looked), most)


def _combinations(problem: SearchProblem, grid: Grid, report: Report) -> np.ndarray:
    """Poses of several free lights, (L, 2 F): those that are best from a sensor of the grid for all quantities or for
    one, of them those that tell most of one."""
    poses, told = settings_of(problem, grid, report)
    shares = (told / np.maximum(told.max(0), np.finfo(float).tiny)).max(1)
    order = np.argsort(-shares, kind="stable")
    lights = poses[order[shares[order] > 0], 2:]
    if not len(lights):
        raise InvalidInput("constraints must leave a setting that can measure, got none")
    first = np.sort(np.unique(lights, axis=0, return_index=True)[1])
    return lights[first[:_MOST_COMBINATIONS]]


def _sets(pool: NetworkPool, count: int, *, bounded: bool) -> tuple[BundleSet, ...]:
    rows, known, firm = pool.known()
    made, quantities, aim = [], pool.problem.scene.quantities, known.aim
    is_absolute = pool.problem.model == DEFAULT_MODEL
    for size, members in enumerate(best_sets(known, count), 1):
        pictures = tuple(pool.looked[int(rows[member])] for member in members)
        prediction = predict_bundle(pictures, **vars(pool.freedom), model=None if is_absolute else pool.problem.model)
        counts = np.array([_COUNTS.get(state, 0.0) for state in prediction.status])
        told = counts > 0
        by_search = known.variances(np.array(members))
        steady = firm.variances(np.array(members)) <= STEEPEST * by_search
        every, near = best_of_all(pool.most, size), best_of_all(known, size)
        impossible = bounded and every is not None and every[0] > 0
        bound = math.inf if not bounded else every[1] if every else pool.most.relaxed(size)[0]
        made.append(
            BundleSet(
                pictures=pictures,
                sensors=pool.freedom.sensors,
                prediction=prediction,
                minimised=float(aim(counts * np.where(told, prediction.u, 0.0) ** 2)) if told.all() else None,
                searched=float(aim(by_search)) if told.all() and np.isfinite(by_search).all() else None,
                exhaustive=None if near is None or near[0] else near[1],
                bound=None if impossible or not math.isfinite(bound) else bound,
                impossible=impossible,
                hard=tuple(q.name for q, ok, held in zip(quantities, told, steady, strict=True) if ok and not held),
            )
        )
    return tuple(made)


def _guarantee(step: float, is_mixed: bool) -> str:
    rest = f"of all pairs of the {step:g} degree grid only the bound is known"
    if is_mixed:
        rest = "where else several lights might stand is not known"
    return f"no exchange of one picture for another that was looked at makes a set better; {rest}"
