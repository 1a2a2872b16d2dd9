"""What the search of a grid found: clearly different candidates, those that can be trusted, and how they are set up.

A search minimises variances by fast evaluation. Bias, and what is too near for either to be told, are known of a single
picture only (`planner.predict`): of the clearly different settings the best is taken in which nothing is `clutter`, as
long as it does not cost too much.

An optimum may lie where an edge is about to be hidden or to lose its contrast. Who sets sensor and light up reads their
angles to a tenth of a degree and errs by a little more; there, too, everything has to be measurable.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from imaging.geometry.projection import direction
from imaging.models import variance_model
from imaging.models.errors import Errors
from imaging.pictures import Pictures
from planner.prediction import Prediction, predict
from planner.ranks import quantity_ranks
from planner.search.exhaustive import DEAREST, BestPair, best_pair
from planner.search.grid import APART, Feasible, Grid, as_array, as_poses, distinct
from planner.search.lights import Mixture, best_lights
from planner.search.local import Partial, alternating, shifted
from planner.search.objective import Report, SearchProblem, minimised
from scenes import Picture, Pose, Scene, status
from scenes.pose import DIGITS
from scenes.status import WORST_FIRST, is_trusted
from scenes.uncertain import Uncertain

AROUND = 0.2  # degrees: how far off everything has to be measurable, at least
STEEPEST = 4.0  # times the variance that is lost by standing so far off: standard deviations are twice as large
_SHELLS = (0.4, 0.8, 1.6, 3.2)  # degrees from an optimum that cannot be set up
_PLACES, _SEED = 64, 1  # of each shell
_DOUBTFUL = WORST_FIRST.index(status.CLUTTER)  # what is measured, though it may be biased


@dataclass(frozen=True, eq=False)
class Searched:
    """The search of a grid for one set of required edges.

    Attributes
    ----------
    problem : SearchProblem
        Of several lights with the best shares.
    grid : Grid
        Of several lights with the best ones for each sensor.
    sensor, light : ndarray, shape (2,), (2 F,)
    variance : float
        The best pair, and what is minimised there.
    partial : Partial or None
        Of the alternating search.
    found : BestPair or None
        Of the exhaustive one.
    alone : Mixture or None
        Of two lights the best where one of them has all.
    """

    problem: SearchProblem
    grid: Grid
    sensor: np.ndarray
    light: np.ndarray
    variance: float
    partial: Partial | None = None
    found: BestPair | None = None
    alone: Mixture | None = None

    @classmethod
    def of(cls, problem: SearchProblem, grid: Grid, search: str, start: Any, shares: str, report: Report) -> Searched:
        """Search all poses of a grid, and the shares of two lights where asked."""
        scene, limits = problem.scene, problem.constraints
        if len(scene.lights) > 1 and (grid.free or (scene.free and not grid.held[1])):
            shared = best_lights(problem, grid, shares, report)
            problem, grid = replace(problem, scene=shared.scene), replace(grid, lights=shared.lights)
            at = shared.found.sensor
            best = grid.sensors[at], shared.lights[at], shared.found.variance
            return cls(problem, grid, *best, found=shared.found, alone=shared.alone)
        partial = found = None
        plain = grid.free and len(scene.free) == 1 and not limits.coupled
        if plain:
            spaces = (Feasible(grid.step_deg, poses) for poses in (grid.sensors, grid.lights))
            partial = alternating(problem, *spaces, np.array(list(Pose.of(start))))
        if search == "exhaustive" or not plain:
            found = best_pair(problem, grid.sensors, grid.lights, report)
        best = found or partial
        return cls(
            problem, grid, grid.sensors[best.sensor], grid.lights[best.light], best.variance, partial, found
        )  # fmt: skip

    def rows(self, count: int) -> list[tuple[float, Searched, np.ndarray, np.ndarray]]:
        """What is minimised, of which search, sensor and lights: of clearly different sensors and of the best pair."""
        best = (self.variance, self, self.sensor, self.light)
        if self.found is None:
            return [best] if np.isfinite(self.variance) else []
        order = np.argsort(self.found.least)
        order = order[np.isfinite(self.found.least[order])]
        picked = order[_spread(direction(self.grid.sensors[order]), count)]
        lights = self.grid.lights[self.found.best_light[picked]]
        least = self.found.least[picked]
        return [*((v, self, *pair) for v, *pair in zip(least, self.grid.sensors[picked], lights, strict=True)), best]


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


def candidates(searches: Sequence[Searched], count: int = 10) -> tuple[Candidate, ...]:
    """The best settings whose sensors or lights differ by 15 degrees, over all sets of required edges.

    None that a close look finds not to measure, nor any of more than four times the least variance of a search, unless
    of the others none measures.
    """
    rows = sorted((row for each in searches for row in each.rows(count)), key=lambda row: row[0])
    near = [row for row in rows if row[0] <= DEAREST * rows[0][0]]
    return _looked_at(near, count) or _looked_at(rows[len(near) :], count)


def _looked_at(rows: Sequence[tuple[float, Searched, np.ndarray, np.ndarray]], count: int) -> tuple[Candidate, ...]:
    """Those that differ and measure by a close look, the best first."""
    chosen = distinct(rows, _differ, 2 * count)
    made = [_candidate(searched, sensor, light) for _, searched, sensor, light in chosen]
    return tuple(sorted((c for c in made if np.isfinite(c.variance)), key=lambda c: c.variance)[:count])


def _candidate(searched: Searched, sensor: np.ndarray, light: np.ndarray) -> Candidate:
    """At the digits of poses that are printed, but for what is held."""
    problem, held = searched.problem, searched.grid.held
    sensor, light = (pose if kept else rounded(pose) for pose, kept in zip((sensor, light), held, strict=True))
    poses = Pose(*map(float, sensor)), as_poses(light)
    found = variance_model(problem.model)(Pictures.of(Picture.of(problem.scene, *poses)))
    worst = int(np.argmax((found.variances_object + found.placed) * problem.objective.shares))
    return Candidate(
        *poses,
        problem.scene.required,
        float(found.variances_object[worst]),
        float(found.variances[worst]),
        float(minimised(found, problem.objective)),
        problem.scene.quantities[worst].name,
    )


def _spread(directions: np.ndarray, count: int) -> list[int]:
    """The first of the directions, then each next one that is far from all before."""
    picked: list[int] = []
    open_ = np.ones(len(directions), bool)
    while open_.any() and len(picked) < count:
        picked.append(int(np.argmax(open_)))
        open_ &= directions @ directions[picked[-1]] < np.cos(np.radians(APART))
    return picked


def _differ(row: tuple, other: tuple) -> bool:
    """Whether sensors or lights are clearly apart."""
    near = np.cos(np.radians(APART))
    pairs = zip(_each(row), _each(other), strict=True)
    return any(direction(one) @ direction(two) < near for one, two in pairs)


def _each(row: tuple) -> np.ndarray:
    """Poses of sensor and lights, (1 + F, 2)."""
    return np.concatenate([row[2], row[3]]).reshape(-1, 2)


class RayTraced(NamedTuple):
    """A setting by ray-traced evaluation.

    ``value`` is what is minimised, ``untrusted`` counts the measurands that are not ``ok``.
    """

    sensor: np.ndarray
    light: np.ndarray
    prediction: Prediction
    value: float
    untrusted: int

    @property
    def rank(self) -> tuple[int, float]:
        """The least is the best: of fewest measurands that are not ``ok`` the least that is minimised."""
        return self.untrusted, self.value

    @classmethod
    def of(cls, problem: SearchProblem, sensor: np.ndarray, light: np.ndarray) -> RayTraced:
        """Of a sensor (2,) and the free lights (2 F,), degrees."""
        told = predict(problem.scene, tuple(map(float, sensor)), as_poses(light), problem.model)
        variances = np.array([getattr(each, f"variance_{problem.objective.unit}") for each in told.measurands])
        if not problem.scene.placement.is_known and problem.objective.unit == "object":
            variances = variances + variance_model(problem.model)(Pictures.of(told.picture)).placed
        untrusted = sum(not is_trusted(each.status) for each in told.measurands)
        return cls(sensor, light, told, float(problem.objective(variances)), untrusted)


def trusted(
    problem: SearchProblem, best: RayTraced, choice: Sequence[Candidate], variance: float
) -> tuple[RayTraced, tuple[Candidate, ...]]:
    """The setting with the fewest measurands that are not ``ok``, the best of them, and the better ones set aside.

    The search glanced at all of them: looked at closely, another one than its best may have the least variance.

    Parameters
    ----------
    best : RayTraced
        The least variance.
    choice : sequence of Candidate
        The others, the best first; none of more than 4 times ``variance`` is taken.
    """
    least, passed = best, []
    for candidate in choice:
        if candidate.variance > DEAREST * variance or (least.untrusted == 0 and candidate.variance >= least.value):
            break
        if candidate.edges != problem.scene.required:
            continue
        poses = np.array(list(candidate.sensor)), as_array(candidate.light)
        if not all(np.allclose(pose, own, atol=10.0**-DIGITS) for pose, own in zip(poses, best[:2], strict=True)):
            other = RayTraced.of(problem, *poses)
            least = min(least, other, key=lambda each: each.rank)
        passed.append(candidate)
    return least, tuple(each for each in passed if each.variance < least.value)


@dataclass(frozen=True, eq=False)
class SettingUp:
    """How a search problem's sensor and lights are set up.

    Attributes
    ----------
    problem : SearchProblem
    held : pair of bool
        Whether the sensor and the lights stay as they are, with all their digits.
    """

    problem: SearchProblem
    held: tuple[bool, bool]

    def offers(self, sensor: np.ndarray, lights: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Settings near one that can be set up: the best of the nearest first, then of ever wider shells.

        Parameters
        ----------
        sensor, lights : ndarray, shape (2,), (2 F,)
            Degrees.
        """
        for sensors, places in (self._nearest(sensor, lights), *(self._shell(sensor, lights, r) for r in _SHELLS)):
            values = self.problem.feasible_values(sensors, places)
            for i in np.argsort(values, kind="stable"):
                if not np.isfinite(values[i]):
                    break
                pair = sensors[i], places[i]
                if self.problem.constraints.allows(self.problem.scene, *pair) and self.is_steady(*pair):
                    yield pair

    def is_steady(self, sensor: np.ndarray, lights: np.ndarray) -> bool:
        """Whether all is measurable there and around it, with a variance not more than four times as large."""
        sensors, places = self.around(sensor, lights)
        values = self.problem.values(sensors, places)
        return bool(_measurable(self.problem.errors(sensors, places)).all() and values.max() <= STEEPEST * values[0])

    def steady(self, sensor: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """The same of each quantity, for one picture of several need not measure all; bool, shape (M,)."""
        errors = self.problem.errors(*self.around(sensor, lights))
        variances = errors.variances_object
        return _measurable(errors).all(0) & (variances.max(0) <= STEEPEST * variances[0])

    def to_digits(self, sensors: np.ndarray, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Settings (n, 2) and (n, 2 F) to the digits of poses, where that keeps the constraints; what is held stays."""
        scene, limits = self.problem.scene, self.problem.constraints
        near = sensors if self.held[0] else rounded(sensors), lights if self.held[1] else rounded(lights)
        keeps = limits.allowed(scene, *near)
        kept = [np.where(keeps[:, None], one, other) for one, other in zip(near, (sensors, lights), strict=True)]
        return kept[0], kept[1]

    def _nearest(self, sensor: np.ndarray, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The setting with its angles rounded up or down, (n, 2) and (n, 2 F)."""
        whole = np.concatenate([sensor, lights])
        step = 10.0**-DIGITS
        ways = [{round(float(up(angle / step)) * step, DIGITS) for up in (np.floor, np.ceil)} for angle in whole]
        angles = np.array(list(product(*map(sorted, ways))) if len(whole) <= 6 else [np.round(whole, DIGITS)])
        return self._kept(sensor, lights, angles[:, :2], angles[:, 2:])

    def _shell(self, sensor: np.ndarray, lights: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """Settings off by ``radius`` degrees in any way, to the digits of poses."""
        ways = np.random.default_rng(_SEED).normal(size=(_PLACES, 2 + lights.size))
        moves = radius * ways / np.linalg.norm(ways, axis=1, keepdims=True)
        return self._kept(sensor, lights, *map(rounded, _moved(sensor, lights, moves)))

    def around(self, sensor: np.ndarray, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The setting itself, then sensor and lights off by what is to be borne, one by one and together."""
        own, others = (how_far(self.problem.scene, role) for role in ("sensor", "light"))
        size = np.array([own, own, *[others] * lights.size])
        together = np.array(list(product((-1, 1), repeat=4)))[:, [0, 1, *(2, 3) * (lights.size // 2)]] / np.sqrt(2)
        single = np.concatenate([np.eye(size.size), -np.eye(size.size)])
        return _moved(sensor, lights, size * np.concatenate([np.zeros((1, size.size)), single, together]))

    def _kept(
        self, sensor: np.ndarray, lights: np.ndarray, sensors: np.ndarray, places: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Different poses (n, 2) and (n, 2 F), with what is held as it is."""
        sensors, places = rounded(sensors), rounded(places)
        if self.held[0]:
            sensors[:] = sensor
        if self.held[1]:
            places[:] = lights
        if self.problem.constraints.same_mount:
            places = np.tile(sensors, (1, lights.size // 2))
        both = np.unique(np.concatenate([sensors, places], axis=1), axis=0)
        return both[:, :2], both[:, 2:]


def _measurable(errors: Errors) -> np.ndarray:
    """Whether each quantity is measured at n settings, though it may be biased, bool (n, M)."""
    edges = np.zeros((len(errors.variances), len(errors.measurands.view.names)), bool)
    return quantity_ranks(errors, edges) >= _DOUBTFUL


def how_far(scene: Scene, role: str) -> float:
    """How far off, degrees, the sensor or the lights have to be able to stand: twice their uncertainty, if it is said.

    Examples
    --------
    >>> import scenes
    >>> how_far(scenes.load("task1"), "sensor")
    0.2
    """
    said: Uncertain | None = getattr(scene.uncertainty, f"{role}_deg")
    return max(AROUND, 2 * (getattr(scene.jitter, f"{role}_deg") if said is None else said.u))


def rounded(poses: np.ndarray) -> np.ndarray:
    """Poses (..., 2 k) of polar angles and azimuths to their digits, azimuths below 360 degrees.

    Examples
    --------
    >>> rounded(np.array([30.04, 359.96]))
    array([30.,  0.])
    """
    found = np.round(poses, DIGITS)
    found[..., 1::2] %= 360
    return found


def _moved(sensor: np.ndarray, lights: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A setting with its sensor and lights moved on their spheres by ``moves`` (n, 2 + 2 F), degrees."""
    sensors = np.array([shifted(sensor, move[:2]) for move in moves])
    parts = [
        np.array([shifted(lights[i : i + 2], move[2 + i : 4 + i]) for move in moves]) for i in range(0, lights.size, 2)
    ]
    return sensors, np.concatenate(parts, axis=1) if parts else np.zeros((len(moves), 0))
