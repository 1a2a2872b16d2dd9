"""The variance over the viewing space with the sensor or the light held fixed: the paper's search space."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.models import DEFAULT_MODEL, ModelName, variance_model
from imaging.models.bias import cluttered
from imaging.pictures import Pictures
from planner.ranks import quantity_ranks
from planner.search.grid import ViewingSpace, as_array, by_light
from planner.search.objective import DEFAULT_OBJECTIVE, Objective, SearchProblem, minimised
from scenes import InvalidInput, Pose, Scene, several
from scenes.errors import given
from scenes.results import Shown, finite, poses
from scenes.status import WORST_FIRST

_CHUNK = 4096  # directions at a time, which bounds the memory


@dataclass(frozen=True, eq=False, repr=False)
class Map(Shown):
    """One number and one status for each direction that the sensor or the light may have.

    Attributes
    ----------
    space : ViewingSpace
    variance : ndarray, shape (N,)
        What is minimised (`variance_map`); infinite where something cannot be measured.
    status : ndarray of str, shape (N,)
        The worst of all quantities, as of `Prediction`: where the variance is infinite the reason; else ``ok`` or,
        where bias was looked for, ``clutter``. From a glance: what a close look at one setting knows besides (rims
        of circles, light between faces) is left out.
    scene : Scene
    sensor, lights : Pose and tuple of Pose, or None
        What is held fixed; None of what takes the space's directions.
    """

    space: ViewingSpace
    variance: np.ndarray
    status: np.ndarray
    scene: Scene
    sensor: Pose | None
    lights: tuple[Pose, ...] | None

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a direction: scene, poses in degrees, variance (None where infinite) and status."""
        moved = [tuple(pose) for pose in self.space.poses.tolist()]
        return [
            {"scene": self.scene.name, **poses(self.sensor or pose, pose if self.lights is None else self.lights)}
            | {"variance": finite(variance), "status": str(status)}
            for pose, variance, status in zip(moved, self.variance, self.status, strict=True)
        ]

    def _line(self) -> str:
        known = int(np.isfinite(self.variance).sum())
        told = f", the least variance {self.variance.min():.3g}" if known else ""
        return f"{self.scene.name}: {len(self.variance)} directions, {known} can be measured from{told}"


def variance_map(
    scene: Scene,
    sensor: Any = None,
    light: Any = None,
    *,
    space: ViewingSpace | None = None,
    model: ModelName = DEFAULT_MODEL,
    objective: Objective = DEFAULT_OBJECTIVE,
) -> np.ndarray:
    """Variance for every direction of the viewing space, one of sensor and light being held fixed.

    Parameters
    ----------
    scene : Scene
    sensor, light : Pose or pair of float, optional
        Exactly one: the one that is held fixed. Degrees. Poses of all free lights where there are several or none.
    space : ViewingSpace, optional
        Where the other one may stand; the paper's 41 347 directions when not given.
    model : {"calibrated", "paper", "bound"}
    objective : {"object", "image"}

    Returns
    -------
    ndarray, shape (len(space),)
        The scene's unit squared, or px^2 (degrees^2 for an angle); infinite where it cannot be measured.

    Raises
    ------
    InvalidInput
        If both or neither of sensor and light are given.

    Examples
    --------
    >>> import scenes
    >>> values = variance_map(scenes.load("task1"), sensor=(30, 135), space=ViewingSpace(10))
    >>> values.shape, int(np.isfinite(values).sum()) > 100
    ((425,), True)
    """
    return _map(SearchProblem.of(scene, model, objective), sensor, light, space, None).variance


def pose_map(
    scene: Scene,
    sensor: Any = None,
    light: Any = None,
    *,
    space: ViewingSpace | None = None,
    model: ModelName = DEFAULT_MODEL,
    objective: Objective = DEFAULT_OBJECTIVE,
    biased: bool = True,
) -> Map:
    """`variance_map` with the status of each direction.

    Without ``biased`` none is ``clutter``: the bias, which decides on it, takes most of the time (on one core 0.4 ms a
    direction of a block, 40 ms of a plate with a hole).

    Examples
    --------
    >>> import scenes
    >>> found = pose_map(scenes.load("task1"), light=(15, 315), space=ViewingSpace(15, (0, 90)))
    >>> sorted(set(found.status.tolist()))
    ['clutter', 'not_visible', 'ok', 'short']
    """
    looked = cluttered if biased and model != "bound" else lambda _: np.array(False)
    return _map(SearchProblem.of(scene, model, objective), sensor, light, space, looked)


def _map(
    problem: SearchProblem, sensor: Any, light: Any, space: ViewingSpace | None,
    clutter: Callable[[Pictures], np.ndarray] | None,
) -> Map:  # fmt: skip
    scene, space = problem.scene, ViewingSpace() if space is None else space
    if (sensor is None) == (light is None):
        raise InvalidInput(f"sensor or light must be given, not both, got sensor={sensor}, light={light}")
    if not isinstance(space, ViewingSpace):
        raise InvalidInput(f"space must be a ViewingSpace, got {given(space)}")
    if light is None and len(scene.free) != 1:
        raise InvalidInput(f"light must be given where not exactly one light is free, got {len(scene.free)} free")
    held = (scene.check_pose("sensor", sensor), None) if light is None else (None, scene.check_lights(several(light)))
    evaluate = variance_model(problem.model)
    values, ranks = np.empty(len(space)), np.full(len(space), WORST_FIRST.index("ok"))
    for at in range(0, len(space), _CHUNK):
        moved = space.poses[at : at + _CHUNK]
        both = (np.array(list(held[0])), moved) if held[0] else (moved, by_light(as_array(held[1])))
        pictures = Pictures.of(scene, *both)
        found = evaluate(pictures)
        values[at : at + _CHUNK] = minimised(found, problem.objective)
        if clutter:
            ranks[at : at + _CHUNK] = quantity_ranks(found, clutter(pictures)).min(-1)
    return Map(space, values, np.array(WORST_FIRST)[ranks], scene, *held)
