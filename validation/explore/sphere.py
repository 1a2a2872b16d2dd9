"""The sphere of poses, coloured by what one measurand would be known to, all else staying where it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from imaging.features.projected_edges import circles
from imaging.models import variance_model
from imaging.pictures import Pictures
from scenes import InvalidInput, Pose, Scene
from validation.explore.state import SENSOR, State

STEP_DEG = 7.5
_AT_ONCE = 16  # poses between looks at whether the sphere is still wanted


@dataclass(frozen=True, eq=False)
class Cells:
    """Patches of a hemisphere: the pose of each one's middle, and its four borders, degrees.

    Attributes
    ----------
    poses : ndarray, shape (N, 2)
        Polar angle and azimuth.
    borders : ndarray, shape (N, 4)
        Least and greatest polar angle, least and greatest azimuth.
    """

    poses: np.ndarray
    borders: np.ndarray


@lru_cache
def cells(step_deg: float = STEP_DEG, *, below: bool = False) -> Cells:
    """Rings of patches of nearly equal size, of the upper hemisphere or the one below.

    Examples
    --------
    >>> len(cells(15.0).poses), cells(15.0).poses[0].tolist()
    (95, [7.5, 30.0])
    >>> cells(15.0, below=True).borders[0].tolist()
    [165.0, 180.0, 0.0, 60.0]
    """
    borders = []
    for low in np.arange(0.0, 90.0, step_deg):
        count = max(6, round(360 * np.sin(np.radians(low + step_deg / 2)) / step_deg))
        starts = 360.0 / count * np.arange(count)
        borders += [(low, low + step_deg, start, start + 360.0 / count) for start in starts]
    found = np.array(borders)
    if below:
        found[:, :2] = 180.0 - found[:, 1::-1]
    return Cells(np.column_stack([found[:, :2].mean(1), found[:, 2:].mean(1)]), found)


def is_below(state: State) -> bool:
    """Whether what is moved stands in the lower hemisphere."""
    pose = state.sensor if state.moving == SENSOR else state.lights[state.moving]
    return pose.polar_deg > 90


def key(state: State) -> tuple:
    """What the values depend on: all poses but that of what is moved, and of that the hemisphere."""
    sensor = None if state.moving == SENSOR else state.sensor
    return (
        state.moving,
        is_below(state),
        sensor,
        tuple(pose for i, pose in enumerate(state.lights) if i != state.moving),
    )


def values(scene: Scene, state: State, poses: np.ndarray) -> Iterator[np.ndarray]:
    """Sigmas (n, M) of all measurands in the object with the moved thing at poses (N, 2), some poses at a time.

    Infinite where a measurand cannot be measured; NaN where the moved thing cannot stand.
    """
    role = "sensor" if state.moving == SENSOR else "light"
    which = 0 if state.moving == SENSOR else scene.free[state.moving]
    for at in range(0, len(poses), _AT_ONCE):
        some = poses[at : at + _AT_ONCE]
        errors = variance_model("calibrated")(_pictures(scene, state, some))
        found = np.sqrt(np.broadcast_to(errors.variances_object, (len(some), len(scene.quantities))))
        stands = np.array([_stands(scene, role, pose, which) for pose in some])
        yield np.where(stands[:, None], found, np.nan)


def _pictures(scene: Scene, state: State, poses: np.ndarray) -> Pictures:
    lights = [np.array(list(pose)) for pose in state.lights]
    if state.moving == SENSOR:
        sensors = poses
    else:
        sensors, lights[state.moving] = np.broadcast_to(np.array(list(state.sensor)), poses.shape), poses
    given = lights[0] if len(lights) == 1 else tuple(np.broadcast_to(each, poses.shape) for each in lights)
    return Pictures.of(scene, sensors, given if lights else None)


def _stands(scene: Scene, role: str, pose: np.ndarray, which: int) -> bool:
    try:
        scene.check_pose(role, Pose(*map(float, pose)), which=which)
    except InvalidInput:
        return False
    return True


def to_message(scene: Scene, state: State, sigmas: np.ndarray) -> dict[str, Any]:
    """Patches and values (N, M) as the page takes them: what `State.shown` says of the chosen measurand.

    ``about``: whether there are rims, of which the sphere takes as little as is certain at a glance.
    """
    quantity, chosen, ratio = scene.quantities[state.measurand], sigmas[:, state.measurand], state.shown != "sigma"
    if state.shown == "ratio":
        chosen = 2 * chosen / quantity.tolerance.half
    if state.shown == "worst":
        known = [(m, each.tolerance.half) for m, each in enumerate(scene.quantities) if each.tolerance]
        chosen = np.max([2 * sigmas[:, m] / half for m, half in known], axis=0)
    return {
        "borders": cells(below=is_below(state)).borders.tolist(),
        "values": [float(f"{value:.4g}") if np.isfinite(value) else None for value in chosen],
        "what": "2 sigma in per cent of half the tolerance zone" if ratio else "sigma",
        "unit": "" if ratio else "degrees" if quantity.is_angle else scene.units,
        "shown": state.shown,
        "moving": state.moving,
        "about": bool(circles(scene)),
    }
