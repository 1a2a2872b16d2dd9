"""From where a part may be looked at, and how much of the image what is measured then fills."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from imaging.geometry.projection import camera_frame
from planner.constraints import same_side
from scenes import Circle, Pose, Scene
from scenes.units import in_unit

_AROUND = 16  # points of a circle
_MARGIN = 0.03  # of the image's half sides, left free around what is measured


@dataclass(frozen=True, eq=False)
class Aspect:
    """What is measured as a camera at a pose sees it.

    Attributes
    ----------
    pose : Pose
    roll_deg : float
        By which the camera is turned about its axis.
    aside : ndarray, shape (2, n)
        Largest distances from the axis to the right and down of n points, mm, over what the margin leaves.
    towards : ndarray, shape (n,)
        How far they are before the reference point, mm.
    """

    pose: Pose
    roll_deg: float
    aside: np.ndarray
    towards: np.ndarray

    @property
    def half_depth_mm(self) -> float:
        """Half of the depth over which they lie."""
        return float(np.ptp(self.towards)) / 2

    @property
    def nearest_mm(self) -> float:
        """The nearest to the camera, from the reference point."""
        return float(self.towards.max())

    def distance(self, half_mm: np.ndarray, focal_mm: np.ndarray) -> np.ndarray:
        """Least distance at which a lens of a focal length, focused there, shows all of it on a sensor.

        A point x beside the axis and z before the reference point is imaged f d x / ((d - f) (d - z)) from the middle,
        which falls with d: the larger root of h d^2 - (h (f + z) + f x) d + h f z = 0.

        Parameters
        ----------
        half_mm : ndarray, shape (..., 2)
            Half of the sensor's width and height, mm.
        focal_mm : ndarray, shape (...)
            Broadcast, mm.
        """
        found = np.zeros(np.broadcast_shapes(half_mm.shape[:-1], focal_mm.shape))
        for x, half in zip(self.aside, np.moveaxis(half_mm, -1, 0), strict=True):
            for aside, towards in _extremes(x, self.towards):
                b = half * (focal_mm + towards) + focal_mm * aside
                root = np.sqrt(np.maximum(b**2 - 4 * half**2 * focal_mm * towards, 0.0))
                found = np.maximum(found, (b + root) / (2 * half))
        return np.maximum(found, np.maximum(focal_mm, self.nearest_mm) * (1 + 1e-6))

    def fits(self, half_mm: np.ndarray, magnification: np.ndarray) -> np.ndarray:
        """Whether a telecentric lens shows all of it; arguments as of `distance`."""
        widest = self.aside.max(1)
        return (widest * np.asarray(magnification)[..., None] <= half_mm).all(-1)

    @property
    def half_diagonal_mm(self) -> float:
        """Farthest of the points from the axis, margin included."""
        return float(np.hypot(*self.aside).max())


def _extremes(aside: np.ndarray, towards: np.ndarray) -> Iterable[tuple[float, float]]:
    """Points that no other is farther aside and nearer than."""
    order = np.argsort(-towards)
    widest = -1.0
    for i in order:
        if aside[i] > widest:
            widest = float(aside[i])
            yield widest, float(towards[i])


def aspects(scene: Scene, poses: Iterable[Pose] = ()) -> tuple[Aspect, ...]:
    """Of the scene's settings, from straight above (or below), and of further poses: upright and on its side each."""
    low, _ = same_side([each.sensor for each in scene.settings[:1]])
    pole = Pose(180.0 if low >= 90 else 0.0, 0.0)
    wanted = dict.fromkeys([*poses, *(each.sensor for each in scene.settings), pole])
    points = measured_points(scene)
    rolls = (scene.camera.roll_deg, scene.camera.roll_deg + 90.0)
    return tuple(_aspect(scene, points, pose, roll) for pose in wanted for roll in rolls)


def _aspect(scene: Scene, points: np.ndarray, pose: Pose, roll: float) -> Aspect:
    frame = camera_frame(scene.camera.tried(roll_deg=roll), np.array(list(pose), float))
    away = points - np.array(scene.camera.look_at)
    mm = in_unit(1.0, scene.units, "mm")
    aside = np.abs(np.stack([away @ frame.right, away @ frame.down])) * mm / (1 - _MARGIN)
    return Aspect(pose, roll, aside, -(away @ frame.forward) * mm)


def measured_points(scene: Scene) -> np.ndarray:
    """Ends of edges and points of circles that are measured; of curved surfaces all of the part's vertices, (n, 3)."""
    solid, found = scene.solid, []
    edges = {edge.name: edge for edge in solid.edges}
    for name in scene.required:
        if name in edges:
            found.append(solid.vertices[list(edges[name].ends)])
            continue
        round_one = solid.round(name)
        found.append(round_one.at(round_one.angles(_AROUND)) if isinstance(round_one, Circle) else solid.vertices)
    return np.unique(np.concatenate(found), axis=0)
