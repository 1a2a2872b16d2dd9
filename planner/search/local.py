"""Local searches: downhill below the grid, many settings or one at a time, and the paper's from neighbour to neighbour
(its Figs 7 and 8)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from imaging.geometry.projection import direction
from planner.search.grid import Directions
from planner.search.objective import SearchProblem
from scenes import InvalidInput, Pose
from scenes.materials.vectors import cross

_MOST_TURNS = 100
Value = Callable[[np.ndarray, np.ndarray], float]
Values = Callable[[np.ndarray, np.ndarray], np.ndarray]
_MOST = np.finfo(float).max  # instead of infinity, of which a simplex makes NaN
_RADIUS, _LEAST_RADIUS = 0.7, 0.01  # units: of the first settings that are asked, and of the last
_NEARER, _SHRUNK = 1 / 3, 1 / 4  # of the radius: a second shell, and the next one where neither gained anything
_BASES = 3  # orthogonal bases, each way, of the directions that are asked at a time
_GAIN, _MOST_POLLS = 1e-4, 60


@dataclass(frozen=True, eq=False)
class Start:
    """Where a local search begins, and what it may move.

    Attributes
    ----------
    sensor, lights : ndarray, shape (2,), (2 F,)
        Degrees; they move in tangent planes of the sphere, so that the poles are places like others.
    angles : ndarray, shape (k,)
        Further angles, degrees.
    held : pair of bool
        Whether the sensor and the lights stay.
    same_mount : bool
        Whether the lights go with the sensor.
    unit_deg : float
        What sizes of simplices are parts of.
    """

    sensor: np.ndarray
    lights: np.ndarray
    angles: np.ndarray = field(default_factory=lambda: np.zeros(0))
    held: tuple[bool, bool] = (False, False)
    same_mount: bool = False
    unit_deg: float = 1.0

    @property
    def _sizes(self) -> tuple[int, int, int]:
        """How many unknowns move the sensor, the lights and the angles."""
        lights = 0 if self.held[1] or self.same_mount else self.lights.size
        return 0 if self.held[0] else 2, lights, self.angles.size

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return sum(self._sizes)

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sensor, lights and angles where the unknowns (`count`,) are ``x``; at 0 the beginning itself."""
        if not x.any():
            return self.sensor, self.lights, self.angles
        by, lights, turns = np.split(self.unit_deg * x, np.cumsum(self._sizes[:2]))
        sensor = shifted(self.sensor, by) if by.size else self.sensor
        if lights.size:
            parts = zip(self.lights.reshape(-1, 2), lights.reshape(-1, 2), strict=True)
            return sensor, np.concatenate([shifted(*part) for part in parts]), self.angles + turns
        moves = self.same_mount and by.size
        return sensor, np.tile(sensor, self.lights.size // 2) if moves else self.lights, self.angles + turns


class Refined(NamedTuple):
    """Where a local search ended, and what is minimised there: never more than at its beginning."""

    sensor: np.ndarray
    lights: np.ndarray
    angles: np.ndarray
    value: float


def refine(
    problem: SearchProblem, pair: Sequence[np.ndarray], step_deg: float, *, value: Value | None = None,
    sizes: Sequence[float] = (_RADIUS, 0.1), known: float = np.inf,
) -> Refined:  # fmt: skip
    """Below a grid of ``step_deg``, from a sensor (2,) and free lights (2 F,), within the constraints.

    What the problem minimises goes down by `poll`; a ``value`` of sensor and lights by `descend`, with ``sizes``.
    """
    start = Start(*pair, same_mount=problem.constraints.same_mount, unit_deg=step_deg)
    if value is None:
        return poll(start, problem.values_from(*pair), known=known)
    wanted = problem.where_feasible(value)
    return descend(start, lambda sensor, lights, _: wanted(sensor, lights), sizes=sizes, known=known)


def poll(start: Start, values: Values, *, known: float = np.inf) -> Refined:
    """Mesh adaptive direct search (Audet and Dennis, SIAM J. Optim. 17, 2006) from a start.

    Settings in seeded random directions are asked together, which takes hardly longer than one; the best is the next
    place, and where none is better they come nearer.

    Parameters
    ----------
    start : Start
        Without angles.
    values : callable
        Sensors (n, 2) and lights (n, 2 F) to what is minimised, (n,); infinite where not feasible.
    known : float
        As of `descend`.

    Raises
    ------
    InvalidInput
        If the beginning is not feasible, or nothing can be measured there.
    """

    def told(places: np.ndarray) -> np.ndarray:
        sensors, lights, _ = zip(*map(start.at, places), strict=True)
        found = values(np.array(sensors), np.array(lights))
        return np.where(np.isnan(found), np.inf, found)

    place, radius = np.zeros(start.count), _RADIUS
    least = _beginning(start, float(told(place[None])[0]), known)
    for turn in range(_MOST_POLLS if start.count else 0):
        ways = _directions(start.count, turn)
        asked = place + radius * np.concatenate([ways, _NEARER * ways])
        found = told(asked)
        best = int(found.argmin())
        if found[best] < (1 - _GAIN) * least:
            place, least = asked[best], float(found[best])
            radius *= 1 if best < len(ways) else 0.5
        elif radius > _LEAST_RADIUS:
            radius *= _SHRUNK
        else:
            break
    return Refined(*start.at(place), least)


def _directions(count: int, turn: int) -> np.ndarray:
    """Unit vectors (n, count), both ways along the axes of orthogonal bases that differ from turn to turn."""
    drawn = np.random.default_rng(turn).normal(size=(_BASES, count, count))
    ways = np.linalg.qr(drawn)[0].reshape(-1, count)
    return np.concatenate([ways, -ways])


def _beginning(start: Start, value: float, known: float) -> float:
    """What is minimised at a start, or what a search found there."""
    found = value if np.isfinite(value) else known
    if not np.isfinite(found):
        place = f"{start.sensor}, {start.lights}"
        raise InvalidInput(f"refinement must begin at a pose that is allowed and measurable, got {place}")
    return found


def descend(
    start: Start,
    value: Callable[[np.ndarray, np.ndarray, np.ndarray], float],
    *,
    sizes: Sequence[float],
    known: float = np.inf,
    trusted: Callable[[np.ndarray, np.ndarray, np.ndarray], bool] | None = None,
    fast: bool = False,
) -> Refined:
    """Nelder-Mead (`scipy.optimize`) from a start.

    Parameters
    ----------
    start : Start
    value : callable
        Sensor, lights and angles to what is minimised; infinite where not feasible.
    sizes : sequence of float
        Of the simplices, one after the other: a fresh one, for the one before may have collapsed at a border.
    known : float
        What a search found at the beginning; it stands where rounding tells the other way whether a plane that is
        seen edge-on is seen, or a border kept.
    trusted : callable, optional
        Whether a setting counts; asked only where it would be the best so far, for it takes long.
    fast : bool
        Whether to end after 100 evaluations of each simplex, instead of 250 (400 of more than four unknowns). It ends
        where the simplex is 0.01 units large and its values are the same to 1e-4: poses are rounded to tenths of a
        degree in the end.

    Raises
    ------
    InvalidInput
        If the beginning is not feasible, or nothing can be measured there.
    """
    begin, least = np.zeros(start.count), 1.0
    unit = _beginning(start, value(*start.at(begin)), known)

    def cost(x: np.ndarray) -> float:
        nonlocal least
        found = value(*start.at(x)) / unit if x.any() else 1.0
        if trusted is not None and found < least:
            if not trusted(*start.at(x)):
                return _MOST
            least = found
        return min(found, _MOST)

    most = 100 if fast else 250 if start.count <= 4 else 400
    x, lowest = _nelder_mead(cost, begin, sizes, {"maxfev": most, "xatol": 0.01, "fatol": 1e-4})
    return Refined(*start.at(x), float(lowest * unit))


def _nelder_mead(cost, x: np.ndarray, sizes: Sequence[float], options: dict) -> tuple[np.ndarray, float]:
    """From x, whose cost counts as 1, by one simplex after the other."""
    from scipy.optimize import minimize  # slow to load, and rarely needed

    lowest = 1.0
    for size in sizes if x.size else ():
        simplex = x + size * np.vstack([np.zeros(x.size), np.eye(x.size)])
        found = minimize(cost, x, method="Nelder-Mead", options=options | {"initial_simplex": simplex})
        if found.fun < lowest:
            x, lowest = found.x, found.fun
    return x, lowest


def shifted(pose: np.ndarray, by_deg: np.ndarray) -> np.ndarray:
    """The pose moved on its sphere by two perpendicular angles (degrees)."""
    centre = direction(pose)
    helper = np.eye(3)[np.argmin(np.abs(centre))]
    one = np.array(cross(centre, helper))  # of two vectors, which NumPy's own takes ten times as long for
    one /= np.linalg.norm(one)
    two = np.array(cross(centre, one))
    x, y, z = centre + np.tan(np.radians(by_deg[0])) * one + np.tan(np.radians(by_deg[1])) * two
    return np.array([np.degrees(np.arctan2(np.hypot(x, y), z)), np.degrees(np.arctan2(y, x)) % 360])


@dataclass(frozen=True)
class SearchStep:
    """One row of the paper's Table 1: what was held fixed, what was found, and the variance there."""

    fixed: str
    fixed_pose: Pose
    found: str
    found_pose: Pose
    variance: float


@dataclass(frozen=True)
class Partial:
    """Where the alternating search stops: no neighbour of the sensor and none of the light is better."""

    sensor: int
    light: int
    variance: float
    trace: tuple[SearchStep, ...]


def alternating(
    problem: SearchProblem,
    sensors: Directions,
    lights: Directions,
    start: np.ndarray,
    first_light: np.ndarray | None = None,
) -> Partial:
    """The paper's procedure FindSensorLight for one set of required edges: sensor and light moved in turn, each from
    neighbour to neighbour, until one does not move.

    Parameters
    ----------
    start : ndarray, shape (2,)
        Where the sensor stands at first, degrees; the nearest direction is taken.
    first_light : ndarray, shape (2,), optional
        Where the search for the first light begins. Where nothing can be measured from there (or nothing is given),
        it begins at the best of a coarse sample of the directions, for a plateau of infinities has no way down.
    """
    at = [sensors.nearest(start), 0 if first_light is None else lights.nearest(first_light)]
    spaces, roles = (sensors, lights), ("sensor", "light")
    trace: list[SearchStep] = []
    for turn in range(_MOST_TURNS):
        moving, fixed = (1, 0) if turn % 2 == 0 else (0, 1)

        def value(indices: np.ndarray, moving=moving, fixed=fixed) -> np.ndarray:
            pair = [spaces[fixed].poses[[at[fixed]] * len(indices)]] * 2
            pair[moving] = spaces[moving].poses[indices]
            return problem.feasible_values(*pair)

        before = at[moving]
        at[moving], variance = _downhill(spaces[moving], before, value)
        poses = [Pose(*map(float, space.poses[k])) for space, k in zip(spaces, at, strict=True)]
        trace.append(SearchStep(roles[fixed], poses[fixed], roles[moving], poses[moving], variance))
        if at[moving] == before and turn:
            break
    return Partial(*at, trace[-1].variance, tuple(trace))


def _downhill(space: Directions, index: int, value) -> tuple[int, float]:
    """Go to the best neighbour until none is better."""
    best = float(value(np.array([index]))[0])
    if not np.isfinite(best):
        sample = np.arange(0, len(space), max(1, len(space) // 500))
        values = value(sample)
        index, best = int(sample[values.argmin()]), float(values.min())
    while True:
        around = space.neighbours(index)
        values = value(around)
        if not len(around) or not values.min() < best:
            return index, best
        index, best = int(around[values.argmin()]), float(values.min())
