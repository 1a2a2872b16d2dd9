"""Who can see what: from where each quantity can be measured, and the fewest pictures that measure all that can be."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.geometry.projection import direction
from imaging.models import DEFAULT_MODEL, ModelName
from planner.constraints import Constraints
from planner.forecast import mildest
from planner.prediction import Prediction, predict
from planner.search.candidates import DEAREST, rounded
from planner.search.grid import Grid, as_poses
from planner.search.objective import Aim, Report, SearchProblem
from planner.search.pool import fast_table, information
from scenes import InvalidInput, Pose, Scene
from scenes.results import Shown, finite, poses
from scenes.status import is_trusted

STEP = 15.0  # degrees of the grid
_ASKED = 24  # settings of which one is asked why a quantity cannot be measured
_USABLE = 0.5  # sigma over half of the tolerance zone: U is the whole of that half
_LOOKS = 40  # settings that are looked at closely
_ALIKE = 20.0  # degrees: sensors that near to one that was looked at are taken to lose as much at a close look


@dataclass(frozen=True)
class Place:
    """From where one quantity can be measured.

    Attributes
    ----------
    name, kind : str
    part : float
        Of the pairs of sensor and light that are allowed: where it can be measured, by a glance; 0 to 1.
    picture : int or None
        The picture, from 1, that measures it with the least variance, of those in which it is ``ok`` if there are any;
        None where none does.
    is_usable : bool
        Whether that is with U, two sigma, of at most half of its tolerance zone; True without a tolerance.
    status : str
        In that picture, looked at closely; of what no picture measures the least serious that was found.
    reason : str
        What decided that status, with its number; empty for ``ok``, and where no more is known than the status says.
    """

    name: str
    kind: str
    part: float
    picture: int | None
    is_usable: bool
    status: str
    reason: str


@dataclass(frozen=True, eq=False)
class Shot:
    """One of the pictures: its poses, and what is predicted there; ``measures`` are names of quantities."""

    sensor: Pose
    light: Pose | tuple[Pose, ...]
    prediction: Prediction
    measures: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Coverage(Shown):
    """Which quantities can be measured from where, and the fewest pictures that measure all that can be.

    Attributes
    ----------
    scene : Scene
    step_deg : float
        Of the grid of directions.
    pairs : int
        Pairs of sensor and light that were glanced at.
    places : tuple of Place
        Of each quantity.
    shots : tuple of Shot
        The fewest pictures; of as many the ones that see most precisely.
    bound : int
        Fewer pictures of the grid than this do not measure the same, by a glance, which sees no less than a close look.
    """

    scene: Scene
    step_deg: float
    pairs: int
    places: tuple[Place, ...]
    shots: tuple[Shot, ...]
    bound: int

    @property
    def lost(self) -> tuple[Place, ...]:
        """What no picture measures."""
        return tuple(each for each in self.places if each.picture is None)

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a quantity: from how much of the grid it is measured, in which picture, and its poses."""
        return [self._row(each, m) for m, each in enumerate(self.places)]

    def _row(self, place: Place, m: int) -> dict[str, Any]:
        shot = None if place.picture is None else self.shots[place.picture - 1]
        told = shot and shot.prediction.measurands[m]
        where = poses(shot.sensor, shot.light) if shot else {}
        return {
            "scene": self.scene.name, "name": place.name, "kind": place.kind, "part": place.part,
            "picture": place.picture, **where, "sigma": told and finite(math.sqrt(told.variance_object)),
            "ratio": told and finite(told.ratio), "status": place.status, "reason": place.reason,
        }  # fmt: skip

    def _line(self) -> str:
        seen = len(self.places) - len(self.lost)
        return f"{self.scene.name}: {seen} of {len(self.places)} measurands, in {len(self.shots)} pictures"


def coverage(
    scene: Scene,
    *,
    model: ModelName = DEFAULT_MODEL,
    step_deg: float | None = None,
    constraints: Constraints | None = None,
    sensor: Any = None,
    light: Any = None,
    report: Report | None = None,
) -> Coverage:
    """Find from where each quantity can be measured, and the fewest pictures that measure all that can be.

    All pairs of a grid are glanced at. The fewest of them that measure every quantity which some pair measures are a
    set cover, solved exactly (HiGHS). What is chosen is looked at closely, and chosen again, until all that is chosen
    has been. To measure is to measure with U, two sigma, of at most half of the tolerance zone, where any pair does.

    Parameters
    ----------
    scene : Scene
        With one light that is free, or with none.
    step_deg : float, optional
        Grid step, degrees; 15 by default.
    model, constraints, sensor, light
        As of `plan`.

    Raises
    ------
    InvalidInput
        If several lights are free.

    Examples
    --------
    >>> import scenes
    >>> found = coverage(scenes.load("plate"), step_deg=30)
    >>> len(found.shots), found.bound, found.lost
    (1, 1, ())
    """
    if len(scene.free) > 1:
        raise InvalidInput(f"lights must be at most one that is free, for a coverage, got {len(scene.free)}")
    report, limits = report or (lambda *_: None), (constraints or Constraints()).on_side_of(scene)
    zones = np.array([1.0 if each.tolerance is None else each.tolerance.half for each in scene.quantities])
    problem = SearchProblem(scene, model, Aim("object", "minimax", 1 / zones**2), limits)
    grid = Grid.of(scene, limits, STEP if step_deg is None else step_deg, sensor, light)
    look = _Look(problem, grid, fast_table(problem, grid.sensors, grid.lights, report))
    shots, measured = look.fewest(report)
    asked = [] if measured.all() else look.asked()
    parts = (look.told > 0).mean((0, 1))
    places = tuple(_place(scene, shots, asked, m, float(part)) for m, part in enumerate(parts))
    return Coverage(scene, grid.step_deg, look.pairs, places, shots, look.bound(measured))


def usable_where(told: np.ndarray, limited: np.ndarray) -> np.ndarray:
    """Where each quantity is measured well enough, bool as ``told`` (..., M); where nowhere, all places that measure
    it.

    Parameters
    ----------
    told : ndarray, shape (..., M)
        Half of the tolerance zone over sigma, squared; 0 where it is not measured.
    limited : ndarray of bool, shape (M,)
        Whether there is a tolerance.

    Examples
    --------
    >>> usable_where(np.array([[9.0, 2.0, 0.0], [1.0, 0.0, 1.0]]), np.array([True, True, False])).tolist()
    [[True, True, False], [False, False, True]]
    """
    enough = (told * _USABLE**2 >= 1) & limited
    nowhere = ~enough.reshape(-1, told.shape[-1]).any(0)
    return enough | (nowhere & (told > 0))


class _Look:
    """A table of what each pair of a grid tells by a glance, of which some are looked at closely.

    Attributes
    ----------
    told : ndarray, shape (S, L, M)
        Half of the tolerance zone over sigma, squared, of sensors, lights and quantities; 0 where not measured.
    shots : dict of int to Shot
        What was looked at closely, by the pair's flat index.
    """

    def __init__(self, problem: SearchProblem, grid: Grid, told: np.ndarray) -> None:
        self.problem, self.grid, self.told = problem, grid, told
        self.limited = np.array([each.tolerance is not None for each in problem.scene.quantities])
        self.shots: dict[int, Shot] = {}

    @property
    def pairs(self) -> int:
        return self.told.shape[0] * self.told.shape[1]

    def fewest(self, report: Report) -> tuple[tuple[Shot, ...], np.ndarray]:
        """The fewest pictures that were looked at closely, and which quantities they measure, bool, shape (M,).

        Chosen by what is expected, looked at, and chosen again, until all that is chosen has been looked at.
        """
        while len(self.shots) < _LOOKS:
            fresh = [row for row in self._chosen(self._expected()) if row not in self.shots]
            if not fresh:
                break
            for row in fresh:
                self.shots[row] = self._shot(row)
                report("looking closely", len(self.shots), _LOOKS)
        seen = list(self.shots)
        close = np.array([self._close(row) for row in seen]).reshape(len(seen), self.told.shape[-1])
        chosen = [seen[k] for k in self._chosen(close)]
        measured = (close[[seen.index(row) for row in chosen]] > 0).any(0)
        return tuple(self.shots[row] for row in chosen), measured

    def bound(self, measured: np.ndarray) -> int:
        """How many pictures of the grid measure some of the quantities at least, by a glance."""
        usable = usable_where(self.told, self.limited).reshape(self.pairs, -1)[:, measured]
        usable = usable[:, usable.any(0)]
        return len(fewest(_kinds(usable))) if usable.any() else 0

    def _chosen(self, table: np.ndarray) -> list[int]:
        """Rows of a table (P, M), the fewest that measure all that any does: of each set the most precise one."""
        usable = usable_where(table, self.limited) if len(table) else np.zeros(table.shape, bool)
        needed = usable.any(0)
        if not needed.any():
            return []
        kinds = _kinds(usable[:, needed])
        with np.errstate(divide="ignore"):
            parts = 1 / table[:, needed]
        found = []
        for kind in kinds[fewest(kinds)]:
            able = np.flatnonzero((usable[:, needed] >= kind).all(1))
            found.append(int(able[parts[able][:, kind].max(1).argmin()]))
        return found

    def _expected(self) -> np.ndarray:
        """What all pairs tell, (P, M): by a close look, else as much less than by a glance as the nearest pair that was
        looked at from about there."""
        flat = self.told.reshape(self.pairs, -1)
        if not self.shots:
            return flat
        seen = np.array(list(self.shots))
        close = np.array([self._close(row) for row in seen])
        with np.errstate(divide="ignore", invalid="ignore"):
            kept = np.where(flat[seen] > 0, np.minimum(close / flat[seen], 1.0), 1.0)
        toward = direction(self.grid.sensors)
        cosines = toward @ toward[seen // self.told.shape[1]].T
        nearest = cosines.argmax(1)
        beside = cosines[np.arange(len(cosines)), nearest] > np.cos(np.radians(_ALIKE))
        factors = np.where(beside[:, None], kept[nearest], 1.0)
        expected = (self.told * factors[:, None]).reshape(self.pairs, -1)
        expected[seen] = close
        return expected

    def _close(self, row: int) -> np.ndarray:
        """As ``told`` of one pair that was looked at closely; what is not trusted counts as `DEAREST` times its
        variance."""
        told = self.shots[row].prediction.measurands
        values = information(np.array([each.variance_object for each in told]), self.problem.objective)
        return np.where([is_trusted(each.status) for each in told], values, values / DEAREST)

    def _shot(self, row: int) -> Shot:
        """A pair at the digits at which it is set up, looked at closely."""
        s, k = np.unravel_index(row, self.told.shape[:2])
        pair = (self.grid.sensors[s], self.grid.lights[k])
        sensor, light = (each if kept else rounded(each) for each, kept in zip(pair, self.grid.held, strict=True))
        poses = Pose(*map(float, sensor)), as_poses(light)
        found = predict(self.problem.scene, *poses, self.problem.model)
        return Shot(*poses, found, tuple(each.name for each in found.measurands if math.isfinite(each.variance_object)))

    def asked(self) -> list[Prediction]:
        """Settings all around, with the light by which most is measured, glanced at: why is something not measured?"""
        sensors, lights = self.grid.sensors, self.grid.lights
        some = np.linspace(0, len(sensors) - 1, min(_ASKED, len(sensors))).round().astype(int)
        best = (self.told > 0).sum(-1).argmax(1)
        return [
            predict(self.problem.scene, Pose(*map(float, sensors[s])), as_poses(lights[best[s]]), self.problem.model,
                    closely=False)
            for s in np.unique(some)
        ]  # fmt: skip


def _place(scene: Scene, shots: tuple[Shot, ...], asked: list[Prediction], m: int, part: float) -> Place:
    quantity = scene.quantities[m]
    seen = [(not is_trusted(each.status), each.variance_object, number, each)
            for number, each in enumerate((shot.prediction.measurands[m] for shot in shots), 1)
            if math.isfinite(each.variance_object)]  # fmt: skip
    if seen:
        *_, number, best = min(seen, key=lambda each: each[:3])
        usable = best.ratio is None or best.ratio <= _USABLE
        return Place(quantity.name, quantity.kind, part, number, usable, best.status, best.reason)
    told = [each.measurands[m] for each in asked] or [shot.prediction.measurands[m] for shot in shots]
    status = mildest(each.status for each in told)
    reason = next((each.reason for each in told if each.status == status and each.reason), "")
    return Place(quantity.name, quantity.kind, part, None, False, status, reason)


def _kinds(tells: np.ndarray) -> np.ndarray:
    """The different rows of a table (P, M) of bool that no other contains."""
    kinds = np.unique(tells, axis=0)
    return kinds[_largest(kinds)]


def _largest(kinds: np.ndarray) -> np.ndarray:
    """Indices of the sets (K, M) that no other contains."""
    inside = (kinds[:, None] <= kinds[None]).all(-1)
    np.fill_diagonal(inside, False)
    return np.flatnonzero(~inside.any(1))


def fewest(sets: np.ndarray) -> np.ndarray:
    """The fewest sets that cover everything: a set cover as an integer program, solved to its end.

    Parameters
    ----------
    sets : ndarray of bool, shape (K, M)
        Which of M things each set holds; every thing is in some set.

    Returns
    -------
    ndarray of int
        Indices of the sets.

    Examples
    --------
    >>> sets = np.array([[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 0]], bool)
    >>> fewest(sets).tolist()
    [0, 2]
    """
    from scipy.optimize import Bounds, LinearConstraint, milp  # slow to load, and rarely needed

    cost, held = np.ones(len(sets)), sets.T.astype(float)
    found = milp(cost, constraints=LinearConstraint(held, lb=1), integrality=cost, bounds=Bounds(0, 1))
    return np.flatnonzero(found.x > 0.5)
