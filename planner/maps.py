"""The variance over the viewing space with the sensor or the light held fixed: the paper's search space."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.imaging.pictures import Pictures
from planner.models import DEFAULT_MODEL, ModelName, variance_model
from planner.prediction import minimised
from planner.search.aim import DEFAULT_OBJECTIVE, Objective
from planner.search.poses import as_array, by_light
from planner.search.viewing import ViewingSpace
from scenes import InvalidInput, Scene, several

_CHUNK = 4096  # directions at a time, which bounds the memory


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
    if (sensor is None) == (light is None):
        raise InvalidInput(f"sensor or light must be given, not both, got sensor={sensor}, light={light}")
    space = ViewingSpace() if space is None else space
    if light is None:
        if len(scene.free) != 1:
            raise InvalidInput(f"light must be given where not exactly one light is free, got {len(scene.free)} free")
        fixed = np.array(list(scene.check_pose("sensor", sensor)))
    else:
        fixed = by_light(as_array(scene.check_lights(several(light))))
    evaluate = variance_model(model)
    values = np.empty(len(space))
    for at in range(0, len(space), _CHUNK):
        part = slice(at, at + _CHUNK)
        poses = (fixed, space.poses[part]) if light is None else (space.poses[part], fixed)
        values[part] = minimised(evaluate(Pictures.of(scene, *poses)), objective)
    return values
