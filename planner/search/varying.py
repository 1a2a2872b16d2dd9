"""Polarisers, lamp and filter as unknowns of the plan, beside the poses.

At fixed poses the brightness is a linear form in (1, cos 2a, sin 2a) of either polariser's angle (nearly so off the
optical axis), so angles every 30 degrees miss no feature of it. They are tried on a coarse grid of poses; from the best
that can be trusted a descent leads down in poses and angles together. The scene's own choice is among the starts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice, product

import numpy as np

from imaging.geometry.projection import direction
from planner.constraints import WHOLE
from planner.design import (
    Choice,
    Chosen,
    Hold,
    Varied,
    angles_of,
    bands_of,
    exposure_time,
    own_choice,
    with_choice,
)
from planner.search.candidates import DEAREST, RayTraced, SettingUp
from planner.search.grid import APART, ViewingSpace, distinct
from planner.search.local import Start, descend
from planner.search.objective import Report, SearchProblem, cut_off, minimised
from scenes import Pose, Scene

ANGLE_STEP = 30.0  # degrees, of either polariser
POSE_STEP = 20.0  # degrees, or that of the plan where it is coarser
_KEPT = 12  # pairs of poses of each choice
_TRACED, _STARTS = 150, 6  # clearly different settings that are ray-traced, and descents
BANDS_WITH = 3  # angles with which all bands are tried
_SIZES, _POLISH = (6.0,), (3.0, 0.5)  # degrees, of a descent's simplices, and of those from its end
_POLISHED = 3  # ends of descents that are polished
_ROUNDS, _ENOUGH = 3, 0.998  # of polishing at most, and what a round must gain for another
_OFFERS = 4  # places that can be set up, tried near one that cannot
_AT_ONCE = 8192  # pairs


@dataclass(frozen=True, eq=False)
class Place:
    """A choice and poses (polar, azimuth) in degrees, with what is minimised there."""

    choice: Choice
    sensor: np.ndarray
    light: np.ndarray
    value: float

    @cached_property
    def _directions(self) -> np.ndarray:
        return direction(np.array([self.sensor, self.light]))

    def differs(self, other: Place) -> bool:
        """Whether anything of it is clearly apart from another's."""
        one, two = self.choice, other.choice
        return bool(
            (one.lamp, one.filter) != (two.lamp, two.filter)
            or _apart(one.analyser_deg, two.analyser_deg) >= APART
            or _apart(one.polarisation_deg, two.polarisation_deg) >= APART
            or (np.einsum("ij,ij->i", self._directions, other._directions) < np.cos(np.radians(APART))).any()
        )


def _apart(a: float | None, b: float | None) -> float:
    """Angle between two polarisers, which are the same after half a turn; infinite if only one is there."""
    if a is None or b is None:
        return 0.0 if a is b else np.inf
    return abs((a - b + 90) % 180 - 90)


@dataclass(frozen=True, eq=False)
class Variation:
    """The search for the best polarisers, lamp and filter, with poses of their own.

    Attributes
    ----------
    problem : SearchProblem
        Of the scene's own choice.
    vary : tuple of {"analyser", "polarisation", "band"}
    hold : {"time", "white"}
    held : pair of bool
        Whether the sensor's and the light's pose stay.
    """

    problem: SearchProblem
    vary: tuple[str, ...]
    hold: Hold
    held: tuple[bool, bool] = (False, False)

    @property
    def scene(self) -> Scene:
        return self.problem.scene

    def run(self, poses: tuple[Pose, Pose], others: tuple[tuple[Pose, Pose], ...], report: Report) -> Varied:
        """What is gained over the scene's own choice at its best ``poses``; ``others`` are more pairs to begin at."""
        sensor, light = (np.array(list(pose)) for pose in poses)
        pairs, angles = self._pairs((sensor, light), others), angles_of(self.scene, self.vary, ANGLE_STEP)
        count = 0

        def tried(choices: list[Choice], sensors: np.ndarray, lights: np.ndarray) -> list[Place]:
            nonlocal count
            found = []
            for choice in choices:
                found += self._best_of(choice, sensors, lights)
                count += len(sensors)
                report("trying choices", count, whole)
            return found

        bands = min(BANDS_WITH, len(angles)) * (len(bands_of(self.scene)) - 1) if "band" in self.vary else 0
        whole = (len(angles) + bands) * (len(pairs[0]) + 1)
        there = tried(angles, *pairs)
        fixed, most = self._fixed(self._place(own_choice(self.scene), sensor, light), there)
        fixed = self._set_up(fixed, most)
        here = fixed.sensor[None], fixed.light[None]
        at_poses = tried(angles, *here)
        there += tried(self._bands(there), *pairs)
        at_poses += tried(self._bands(at_poses), *here)
        same = self._lowest(at_poses, fixed, most, 2, poses=False)
        best = self._set_up(self._lowest([*there, same], same, most, _STARTS), most)
        best = min(best, same, key=_value)
        if best.choice == fixed.choice:  # what is gained then, better poses gain
            fixed = same = best
        return Varied(self.vary, self.hold, *map(self._told, (fixed, same, best)), count, _GUARANTEE)

    def _fixed(self, plan: Place, found: list[Place]) -> tuple[Place, int]:
        """The best setting of the scene's own choice, and how many of its measurands cannot be trusted.

        The plan's, unless another that does not cost too much can be trusted more.
        """
        least, most = plan, self._untrusted(plan)
        own = [place for place in found if place.choice == plan.choice and place.value <= DEAREST * plan.value]
        for place in _clear(own):
            if most == 0:
                break
            wrong = self._untrusted(place)
            if wrong < most:
                least, most = place, wrong
        return self._lowest([least, *own], least, most, _STARTS, angles=False), most

    def _set_up(self, place: Place, most: int) -> Place:
        """The nearest place of poses that can be set up and trusted as much; where there is none the place itself."""
        ways = SettingUp(self._with(place.choice), self.held)
        offers = (self._place(place.choice, *pair) for pair in ways.offers(place.sensor, place.light))
        return next((each for each in islice(offers, _OFFERS) if self._untrusted(each) <= most), place)

    def _bands(self, found: list[Place]) -> list[Choice]:
        """The other bands with those angles that were best so far."""
        if "band" not in self.vary:
            return []
        angles = list(dict.fromkeys(place.choice for place in sorted(found, key=_value)))[:BANDS_WITH]
        return [
            replace(choice, lamp=lamp, filter=filter_)
            for choice, (lamp, filter_) in product(angles, bands_of(self.scene)[1:])
        ]

    def _pairs(self, poses, others) -> tuple[np.ndarray, np.ndarray]:
        """Allowed pairs of a coarse grid, and those that are given, shape (n, 2) each."""
        limits, scene = self.problem.constraints, self.scene
        polars = limits.sensor_polar_deg or WHOLE, limits.light_polar_deg or WHOLE
        sensors, lights = (
            pose[None] if held else ViewingSpace(POSE_STEP, polar).poses
            for held, pose, polar in zip(self.held, poses, polars, strict=True)
        )
        sensors, lights = sensors[limits.sensors(scene, sensors)], lights[limits.lights(lights)]
        grid = np.array(list(product(sensors.tolist(), lights.tolist())), float).reshape(-1, 2, 2)
        grid = grid[limits.pairs(scene, grid[:, 0], grid[:, 1])]
        given = np.array([poses, *([list(pose) for pose in pair] for pair in others)], float)
        kept = [
            all(not h or np.allclose(a, b) for h, a, b in zip(self.held, pair, poses, strict=True)) for pair in given
        ]
        both = np.concatenate([given[kept], grid])
        return both[:, 0], both[:, 1]

    def _best_of(self, choice: Choice, sensors: np.ndarray, lights: np.ndarray) -> list[Place]:
        """The best pairs; if there are any, of those where no edge's levels are cut off at the end of the scale.

        What is cut off scatters less, so that a plain minimum is led to where every measurement is biased; descents
        do not go there, either.
        """
        parts = [slice(at, at + _AT_ONCE) for at in range(0, len(sensors), _AT_ONCE)]
        found = [self._values(choice, sensors[part], lights[part]) for part in parts]
        least, cut = (np.concatenate(each) for each in zip(*found, strict=True))
        whole = np.where(cut, np.inf, least)
        least = whole if np.isfinite(whole).any() else least
        order = [i for i in np.argsort(least, kind="stable")[:_KEPT] if np.isfinite(least[i])]
        return [Place(choice, sensors[i], lights[i], float(least[i])) for i in order]

    def _with(self, choice: Choice) -> SearchProblem:
        return replace(self.problem, scene=with_choice(self.scene, choice, self.hold))

    def _values(self, choice: Choice, sensors: np.ndarray, lights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What is minimised of pairs (n, 2), and where the end of the scale has cut levels off; shape (n,) each."""
        world = self._with(choice)
        found = world.errors(sensors, lights)
        return minimised(found, world.objective), cut_off(found)

    def _lowest(self, found: list[Place], known: Place, most: int, starts: int, **free: bool) -> Place:
        """The lowest place to which a descent leads from the best ones that can be trusted; ``known`` at worst."""
        trusted = (place for place in _clear(found) if self._untrusted(place) <= most)
        ends = [known, *(self._descended(place, most, **free) for place in islice(trusted, starts))]
        return min((self._polished(end, most, **free) for end in sorted(ends, key=_value)[:_POLISHED]), key=_value)

    def _polished(self, place: Place, most: int, **free: bool) -> Place:
        """Descents from where one ended, as long as they gain anything."""
        for _ in range(_ROUNDS):
            before, place = place, self._descended(place, most, _POLISH, **free)
            if place.value > _ENOUGH * before.value:
                break
        return place

    def _descended(
        self, begin: Place, most: int, sizes: tuple[float, ...] = _SIZES, *, poses: bool = True, angles: bool = True
    ) -> Place:
        """Downhill in the poses that are free and the angles that are varied, as long as it can be trusted."""
        turning = self._turning(begin.choice) if angles else []
        held = tuple(held or not poses for held in self.held)

        def choice(turns: np.ndarray) -> Choice:
            return replace(begin.choice, **{n: float(turn) % 180 for n, turn in zip(turning, turns, strict=True)})

        def value(sensor: np.ndarray, light: np.ndarray, turns: np.ndarray) -> float:
            if not all(held) and not self.problem.constraints.allows(self.scene, sensor, light):
                return np.inf
            (found,), (cut,) = self._values(choice(turns), sensor[None], light[None])
            return np.inf if cut else float(found)

        def trust(sensor: np.ndarray, light: np.ndarray, turns: np.ndarray) -> bool:
            return self._untrusted(Place(choice(turns), sensor, light, np.nan)) <= most

        own = np.array([getattr(begin.choice, name) for name in turning], float)
        if not np.isfinite(value(begin.sensor, begin.light, own)):
            return self._place(begin.choice, begin.sensor, begin.light)
        start = Start(begin.sensor, begin.light, own, held, self.problem.constraints.same_mount)
        sensor, light, turns, _ = descend(start, value, sizes=sizes, trusted=trust, fast=True)
        ends = (choice(turns), sensor, light), (begin.choice, begin.sensor, begin.light)
        return min((self._place(*end) for end in ends), key=_value)

    def _turning(self, choice: Choice) -> list[str]:
        """Names of a choice's angles that are varied."""
        names = ("analyser", "analyser_deg"), ("polarisation", "polarisation_deg")
        return [name for vary, name in names if vary in self.vary and getattr(choice, name) is not None]

    def _untrusted(self, place: Place) -> int:
        return RayTraced.of(self._with(place.choice), place.sensor, place.light).untrusted

    def _place(self, choice: Choice, sensor: np.ndarray, light: np.ndarray) -> Place:
        """With its ray-traced value."""
        world = self._with(choice)
        return Place(choice, sensor, light, float(minimised(world.errors(sensor, light), world.objective)))

    def _told(self, place: Place) -> Chosen:
        world = self._with(place.choice)
        status = RayTraced.of(world, place.sensor, place.light).prediction.status
        poses = Pose(*map(float, place.sensor)), Pose(*map(float, place.light))
        time = exposure_time(self.scene, place.choice, self.hold)
        return Chosen(place.choice, world.scene, *poses, place.value, status, time)


_GUARANTEE = (
    f"none: the lowest end of up to {_STARTS} descents from the best of a grid (angles every {ANGLE_STEP:g} degrees and"
    f" none, poses every {POSE_STEP:g}, all bands with the best {BANDS_WITH} angles), at worst the fixed choice"
)


def _value(place: Place) -> float:
    return place.value


def _clear(found: list[Place]) -> Iterator[Place]:
    """Clearly different ones, the best first."""
    return distinct(sorted(found, key=_value), Place.differs, _TRACED)
