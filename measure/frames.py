"""Where each required edge is expected in the image, and where along it edge points are sought."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from measure import status
from planner.locator import reach
from planner.outline import Outline, outline
from planner.view import direction, facing, project
from scenes import Pose, Scene

_MIN_POINTS = 3


@dataclass(frozen=True)
class EdgeFrame:
    """Coordinates along and across one expected edge.

    A point of the image is ``origin + along * t + offset * n`` with t the unit direction and n = (-t_y, t_x).

    Attributes
    ----------
    name : str
    origin, direction : ndarray, shape (2,)
        Start of the edge's image, px, and its unit direction t.
    stations : ndarray, shape (m,)
        Places along the edge, 1 px apart, where an edge point is sought; the trimmed corners and what lies outside
        the image are left out.
    status : str
        ``ok``, ``clutter``, ``short`` or ``not_visible``, as far as geometry alone tells.
    """

    name: str
    origin: np.ndarray
    direction: np.ndarray
    stations: np.ndarray
    status: str

    @property
    def normal(self) -> np.ndarray:
        return np.array([-self.direction[1], self.direction[0]])

    def at(self, along: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Image coordinates (x, y), px, of places in this frame."""
        return self.origin + along[..., None] * self.direction + offset[..., None] * self.normal

    def coordinates(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(along, offset) of image points (..., 2), px."""
        away = points - self.origin
        return away @ self.direction, away @ self.normal


def edge_frames(scene: Scene, sensor: Pose) -> tuple[EdgeFrame, ...]:
    """A frame for each of the task's edges, in the order of `Task.edges`."""
    view = outline(scene, np.array(list(sensor)))
    return tuple(_frame(scene, sensor, view, i) for i in range(len(view.names)))


def _frame(scene: Scene, sensor: Pose, view: Outline, i: int) -> EdgeFrame:
    start, stop = view.ends[i]
    length = float(view.lengths[i])
    if not view.visible[i] or not length > 0:
        return EdgeFrame(view.names[i], np.zeros(2), np.array([1.0, 0.0]), np.empty(0), status.NOT_VISIBLE)
    along = (stop - start) / length
    first, last = view.trims[i, 0], length - view.trims[i, 1]
    stations = first + (last - first) % 1 / 2 + np.arange(int(last - first) + 1) if last > first else np.empty(0)
    inside = _inside(scene, start + stations[:, None] * along)
    if stations.size >= _MIN_POINTS and inside.sum() < _MIN_POINTS:
        state = status.NOT_VISIBLE
    elif stations.size < _MIN_POINTS:
        state = status.SHORT
    else:
        state = status.CLUTTER if _crowded(scene, sensor, view.names[i], start, stop, view.trims[i]) else status.OK
    return EdgeFrame(view.names[i], start, along, stations[inside], state)


def _inside(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Which points have their whole search window and smoothing kernel within the image."""
    margin = scene.locator.window_px + 4 * scene.locator.scale_px + 1
    size = np.array([scene.camera.width, scene.camera.height])
    return ((points >= margin) & (points <= size - 1 - margin)).all(-1)


def _crowded(scene: Scene, sensor: Pose, name: str, start: np.ndarray, stop: np.ndarray, trims: np.ndarray) -> bool:
    """Whether another visible edge that does not share a corner comes too near to the part that is used."""
    solid, pose = scene.solid, np.array(list(sensor))
    seen = facing(solid, scene.camera.distance * direction(pose))
    corners = project(solid.vertices, pose, scene.camera)
    edge = solid.edge(name)
    length = np.linalg.norm(stop - start)
    used = start + np.linspace(trims[0], length - trims[1], 33)[:, None] * (stop - start) / length
    limit = reach(scene.locator.scale_px, scene.camera.blur_px)
    return any(
        _distance_to_segment(used, *corners[list(other.ends)]).min() < limit
        for other in solid.edges
        if not set(other.ends) & set(edge.ends) and seen[list(other.faces)].any()
    )


def _distance_to_segment(points: np.ndarray, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    along = stop - start
    fraction = np.clip((points - start) @ along / max(float(along @ along), np.finfo(float).tiny), 0, 1)
    return np.linalg.norm(points - start - fraction[:, None] * along, axis=1)
