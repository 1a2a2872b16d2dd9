"""Candidate poses of sensor and lights: directions nearly evenly spread over the sphere (section 6 of the paper)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from imaging.geometry.projection import direction
from planner.constraints import WHOLE, Constraints
from scenes import InvalidInput, Pose, Scene, several
from scenes.arrays import finite, number
from scenes.errors import given
from scenes.pose import one_or_all


def distinct(items: Iterable[T], differ: Callable[[T, T], bool], most: int) -> Iterator[T]:
    """Those items that differ from all before, at most ``most``."""
    kept: list[T] = []
    for item in items:
        if len(kept) == most:
            return
        if all(differ(item, other) for other in kept):
            kept.append(item)
            yield item


def by_light(lights: np.ndarray) -> np.ndarray | tuple[np.ndarray, ...]:
    """What `Pictures.of` takes: the poses (..., 2) of the one free light, else a tuple of such."""
    parts = tuple(lights[..., i : i + 2] for i in range(0, lights.shape[-1], 2))
    return parts[0] if len(parts) == 1 else parts


def as_poses(lights: np.ndarray) -> Pose | tuple[Pose, ...]:
    """One setting's lights (2 F,): the pose of the one free light, else a tuple of such."""
    return one_or_all(tuple(Pose(*map(float, lights[i : i + 2])) for i in range(0, lights.size, 2)))


def as_array(lights: Pose | tuple[Pose, ...]) -> np.ndarray:
    """And back, (2 F,)."""
    return np.array([list(pose) for pose in several(lights)], float).ravel()


if TYPE_CHECKING:
    from scipy.spatial import KDTree

T = TypeVar("T")
APART = 15.0  # degrees between two sensors, or two lights, of clearly different settings
_NEIGHBOUR = 1.6  # steps; reaches the ring's next points and those beside them on the rings above and below


@dataclass(frozen=True, eq=False)
class Directions(ABC):
    """Poses on a sphere, with their neighbours at a step of ``step_deg``."""

    step_deg: float

    @property
    @abstractmethod
    def poses(self) -> np.ndarray:
        """All directions as (polar, azimuth), degrees, shape (N, 2)."""

    def __len__(self) -> int:
        return len(self.poses)

    @cached_property
    def directions(self) -> np.ndarray:
        """Unit vectors, shape (N, 3)."""
        return direction(self.poses)

    @cached_property
    def _tree(self) -> KDTree:
        from scipy.spatial import KDTree  # slow to load, which a prediction does not need

        return KDTree(self.directions)

    def neighbours(self, index: int) -> np.ndarray:
        """Indices of the directions next to one."""
        near = self._tree.query_ball_point(self.directions[index], 2 * np.sin(np.radians(self._reach) / 2))
        return np.array([i for i in near if i != index], int)

    @property
    def _reach(self) -> float:
        return _NEIGHBOUR * self.step_deg

    def nearest(self, pose: np.ndarray) -> int:
        """Index of the direction nearest to a pose (polar, azimuth)."""
        return int(self.nearest_direction(direction(np.asarray(pose, float))))

    def nearest_direction(self, vectors: np.ndarray) -> np.ndarray:
        """Indices of the directions nearest to unit vectors (..., 3)."""
        return self._tree.query(vectors)[1]


@dataclass(frozen=True, eq=False)
class ViewingSpace(Directions):
    """The paper's tessellation: polar angle every ``step_deg``, azimuth every ``step_deg`` / sin(polar).

    Parameters
    ----------
    step_deg : float
        1 in the paper, which gives 41 347 directions: the printed set, not the printed sum (41 167) or total (41 348).
    polar_deg : pair of float
        Least and greatest polar angle; (0, 90) is the upper hemisphere.

    Raises
    ------
    InvalidInput
        If the step is not between 0.1 and 90, or the range is empty.

    Examples
    --------
    >>> len(ViewingSpace()), len(ViewingSpace(polar_deg=(0, 90)))
    (41347, 20854)
    """

    step_deg: float = 1.0
    polar_deg: tuple[float, float] = (0.0, 180.0)

    def __post_init__(self) -> None:
        if not 0.1 <= number(self.step_deg, "step_deg") <= 90:
            raise InvalidInput(f"step must be between 0.1 and 90 degrees, got {self.step_deg}")
        if finite(self.polar_deg, "polar range").shape != (2,):
            raise InvalidInput(f"polar range must be two angles, got {given(self.polar_deg)}")
        if not 0 <= self.polar_deg[0] <= self.polar_deg[1] <= 180:
            raise InvalidInput(f"polar range must be two rising angles between 0 and 180, got {self.polar_deg}")

    @cached_property
    def poses(self) -> np.ndarray:
        """All directions as (polar, azimuth), degrees, shape (N, 2), ring by ring from the north pole."""
        rings = np.arange(round(180 / self.step_deg) + 1) * self.step_deg
        low, high = self.polar_deg
        rings = rings[(rings >= low - 1e-9) & (rings <= min(high, 180.0) + 1e-9)]
        if not rings.size:  # a range between two of the grid's rings
            rings = np.array([(low + min(high, 180.0)) / 2])
        return np.concatenate([self._ring(polar) for polar in rings])

    def _ring(self, polar: float) -> np.ndarray:
        sine = np.sin(np.radians(polar))
        if polar < 1e-9 or polar > 180 - 1e-9:
            return np.array([[polar, 0.0]])
        azimuths = np.arange(np.floor(360 * sine / self.step_deg + 1e-9) + 1) * self.step_deg / sine
        return np.column_stack([np.full_like(azimuths, polar), azimuths])


@dataclass(frozen=True, eq=False)
class Feasible(Directions):
    """Those poses (N, 2) of a viewing space that constraints allow."""

    allowed: np.ndarray

    @property
    def poses(self) -> np.ndarray:
        return self.allowed


@dataclass(frozen=True, eq=False)
class Grid:
    """Candidate poses, each feasible by itself.

    Attributes
    ----------
    step_deg : float
    sensors, lights : ndarray, shape (S, 2), (L, 2) or (1, 2 F)
        Degrees; one row of what is held, (1, 0) without a free light.
    held : pair of bool
        Whether the sensor's and the lights' poses are given.
    """

    step_deg: float
    sensors: np.ndarray
    lights: np.ndarray
    held: tuple[bool, bool]

    @property
    def free(self) -> bool:
        """Whether neither is held."""
        return not any(self.held)

    @classmethod
    def of(cls, scene: Scene, constraints: Constraints, step_deg: float, sensor: Any = None, light: Any = None) -> Grid:
        """All feasible poses of a viewing space, or the one at which ``sensor`` or ``light`` is held.

        Raises
        ------
        InvalidInput
            If what is held does not keep the constraints, or nothing is left.
        """
        if constraints.same_mount:  # the one says the other
            sensor, light = (light if sensor is None else sensor), (sensor if light is None else light)
        held = sensor is not None, light is not None
        sensors = ViewingSpace(step_deg, constraints.sensor_polar_deg or WHOLE).poses
        lights = ViewingSpace(step_deg, constraints.light_polar_deg or WHOLE).poses if scene.free else np.zeros((1, 0))
        if held[0]:
            sensors = np.array([list(scene.check_pose("sensor", sensor))])
        if held[1]:
            lights = as_array(scene.check_lights(several(light)))[None]
        if all(held) and not constraints.pairs(scene, sensors[0], lights[0]):
            told = " ".join(map(str, (Pose(*sensors[0].tolist()), "and", *several(as_poses(lights[0])))))
            raise InvalidInput(
                f"sensor and light must keep the constraints on both (mount, separation, bodies, view), got {told}"
            )
        sensors = _kept("sensor", sensors, constraints.sensors(scene, sensors), held[0])
        if scene.free:
            allowed = constraints.lights(lights.reshape(-1, 2)).reshape(len(lights), -1).all(-1)
            lights = _kept("light", lights, allowed, held[1])
        if not len(sensors) or not len(lights):
            raise InvalidInput("constraints must leave a pose for sensor and light, got none")
        return cls(step_deg, sensors, lights, held)


def _kept(role: str, poses: np.ndarray, allowed: np.ndarray, held: bool) -> np.ndarray:
    """The allowed ones; all of what is held must be."""
    if held and not allowed.all():
        raise InvalidInput(f"{role} must keep the constraints, got {Pose(*map(float, poses[0][:2]))}")
    return poses[allowed]
