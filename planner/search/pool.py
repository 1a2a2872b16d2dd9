"""Candidates for the pictures of a set: what each tells of each quantity, at a glance and looked at closely.

Information is 1 / (share x variance), so that it adds over pictures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from imaging.geometry.projection import direction
from planner.design import Choice
from planner.prediction import Prediction, predict
from planner.search.candidates import SettingUp
from planner.search.grid import Grid, as_poses
from planner.search.lights import best_lights
from planner.search.local import refine
from planner.search.objective import Aim, Report, SearchProblem, cut_off
from planner.search.sets import PictureInformation, better
from scenes.status import is_trusted

_ALIKE = 15.0  # degrees: beside a picture with clutter, what is clutter there is taken to be so until it is traced
_SIZES = (0.7, 0.15)  # grid steps: of the first simplex of a local search


def information(variances: np.ndarray, aim: Aim) -> np.ndarray:
    """1 / (share x variance) of variances (..., M); 0 where infinite."""
    with np.errstate(divide="ignore"):
        return np.where(np.isfinite(variances), 1 / (variances * aim.shares), 0.0)


def fast_table(
    problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report, *, uncut: bool = False
) -> np.ndarray:
    """Information of every pair of sensors (S, 2) and lights (L, 2), shape (S, L, M); 0 where not feasible, and, asked
    for ``uncut``, where levels are cut off: what is cut off scatters less, and every measurement of it is biased."""
    told = np.empty((len(sensors), len(lights), len(problem.scene.quantities)))
    for part, errors, allowed in problem.table(sensors, lights, report):
        good = allowed & ~cut_off(errors) if uncut else allowed
        told[part] = information(errors.variances_object, problem.objective) * good[..., None]
    return told


def settings_of(problem: SearchProblem, grid: Grid, report: Report) -> tuple[np.ndarray, np.ndarray]:
    """Sensors of a grid, each with the several lights that are best for all quantities, and for each alone.

    Settings (P, 2 + 2 F), and their information (P, M); 0 where not feasible.
    """
    scene, poses, told = problem.scene, [], []
    count = len(scene.quantities)
    for each in (problem, *(_of_one(problem, m) for m in range(count if count > 1 else 0))):
        lights = best_lights(each, grid, "given", report).lights
        allowed = problem.constraints.allowed(scene, grid.sensors, lights)
        variances = problem.errors(grid.sensors, lights).variances_object
        poses.append(np.concatenate([grid.sensors, lights], 1))
        told.append(information(variances, problem.objective) * allowed[:, None])
    return np.concatenate(poses), np.concatenate(told)


def _of_one(problem: SearchProblem, m: int) -> SearchProblem:
    """Of the m-th quantity alone."""
    scene = problem.scene.tried(measurands=(problem.scene.measurands[m],))
    return replace(problem, scene=scene, objective=Aim.of(scene.quantities, problem.objective.unit))


@dataclass(frozen=True, eq=False)
class World:
    """What stands before lens and lamp in some candidates: a choice, and sensor and light of the scene with it.

    Attributes
    ----------
    choice : Choice or None
        None: the scene's own.
    ways : SettingUp
        Of that scene's search problem.
    """

    choice: Choice | None
    ways: SettingUp

    @property
    def problem(self) -> SearchProblem:
        return self.ways.problem


class Pool:
    """Candidates, rows of ``poses``; grows when a local search finds one beside them.

    Attributes
    ----------
    worlds : list of World
        The scene's own first.
    of_world : ndarray of int, shape (P,)
        Of which world each row is.
    poses : ndarray, shape (P, 2 + 2 F)
        Sensor and free lights, each polar angle and azimuth, degrees, to the digits at which they are set up.
    told : ndarray, shape (P, M)
        Their information by fast evaluation (`information`).
    traced : dict
        Predictions of the rows that were ray-traced.
    steady : dict
        Of these rows which quantities are measured around them, too, shape (M,).
    """

    def __init__(self, own: World, poses: np.ndarray, told: np.ndarray) -> None:
        self.aim, self.worlds = own.problem.objective, [own]
        self.poses, self.told = np.empty((0, poses.shape[1])), np.empty((0, told.shape[1]))
        self.of_world = np.empty(0, int)
        self.traced: dict[int, Prediction] = {}
        self.steady: dict[int, np.ndarray] = {}
        self._append(0, poses, told)

    def join(self, world: World, poses: np.ndarray, told: np.ndarray) -> None:
        """Further rows, of another world."""
        self.worlds.append(world)
        self._append(len(self.worlds) - 1, poses, told)

    def world(self, row: int) -> World:
        """Of a row."""
        return self.worlds[self.of_world[row]]

    def trace(self, row: int) -> None:
        """Ray-traced evaluation of a row, once."""
        if row not in self.traced:
            (sensor, lights), world = self.setting(row), self.world(row)
            problem = world.problem
            self.traced[row] = predict(problem.scene, tuple(sensor.tolist()), as_poses(lights), problem.model)
            self.steady[row] = world.ways.steady(sensor, lights)

    def setting(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Sensor (2,) and free lights (2 F,) of a row."""
        return self.poses[row, :2], self.poses[row, 2:]

    def _append(self, world: int, poses: np.ndarray, told: np.ndarray) -> None:
        poses = np.concatenate(self.worlds[world].ways.to_digits(poses[:, :2], poses[:, 2:]), axis=1)
        self.poses, self.told = np.concatenate([self.poses, poses]), np.concatenate([self.told, told])
        self.of_world = np.concatenate([self.of_world, np.full(len(poses), world)])

    @property
    def seen(self) -> np.ndarray:
        """Ray-traced rows, in their order."""
        return np.array(sorted(self.traced), int)

    def known(self) -> PictureInformation:
        """What the rows `seen` tell, of what is measured around them, too, where any of them does."""
        told = [self.traced[row].measurands for row in self.seen]
        values = information(np.array([[each.variance_object for each in row] for row in told]), self.aim)
        steady = np.array([self.steady[row] for row in self.seen])
        values = np.where(steady | ~steady.any(0), values, 0.0)
        fine = np.array([[is_trusted(each.status) for each in row] for row in told])
        return PictureInformation(np.where(fine, values, 0.0), np.where(fine, 0.0, values), self.aim.over)

    def expected(self) -> PictureInformation:
        """What all rows tell: ray-traced, else by fast evaluation, cluttered as the nearest ray-traced row is."""
        cluttered = np.zeros(self.told.shape, bool)
        seen = self.seen
        if len(seen):
            known = self.known()
            ways = [direction(self.poses[:, i : i + 2]) for i in range(0, self.poses.shape[1], 2)]
            cosine = np.min([each @ each[seen].T for each in ways], 0)
            cosine[self.of_world[:, None] != self.of_world[seen]] = -np.inf
            nearest = cosine.argmax(1)
            beside = cosine[np.arange(len(cosine)), nearest] > np.cos(np.radians(_ALIKE))
            cluttered = (known.clutter > 0)[nearest] & beside[:, None]
        ok, clutter = np.where(cluttered, 0.0, self.told), np.where(cluttered, self.told, 0.0)
        if len(seen):
            ok[seen], clutter[seen] = known.ok, known.clutter
        return PictureInformation(ok, clutter, self.aim.over)

    def refine(self, row: int, rest: PictureInformation, step_deg: float) -> int:
        """The row after a local search of its poses, or itself where that finds nothing better; the row's number.

        Parameters
        ----------
        rest : PictureInformation
            One row: what the other pictures of its set tell.

        What is clutter in the row is taken to stay so on the way. If ray-traced evaluation does not bear out what the
        fast one told, a shorter search is tried.
        """
        (sensor, light), problem = self.setting(row), self.world(row).problem
        cluttered = np.array([not is_trusted(each.status) for each in self.traced[row].measurands])

        def told(s: np.ndarray, k: np.ndarray) -> np.ndarray:
            return information(problem.errors(s[None], k[None]).variances_object[0], self.aim)

        def score(s: np.ndarray, k: np.ndarray) -> tuple[int, float, float]:
            values = told(s, k)
            return rest.plus(np.where(cluttered, 0.0, values), np.where(cluttered, values, 0.0))

        def value(s: np.ndarray, k: np.ndarray) -> float:
            here = score(s, k)
            return here[1] if here[0] <= begun[0] else np.inf

        def ray_traced(which: int) -> tuple[int, float, float]:
            known, at = self.known(), int(np.searchsorted(self.seen, which))
            return rest.plus(known.ok[at], known.clutter[at])

        begun = score(sensor, light)
        for size in _SIZES:
            end = refine(problem, (sensor, light), step_deg, value=value, sizes=(size,))
            if end.value < begun[1]:
                found, there = len(self.poses), np.concatenate([end.sensor, end.lights])
                self._append(int(self.of_world[row]), there[None], told(end.sensor, end.lights)[None])
                self.trace(found)
                if better(ray_traced(found), ray_traced(row)):
                    return found
        return row
