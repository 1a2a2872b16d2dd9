"""The required edges by formula, without a render: levels and slopes on both sides, and what a change of them does.

Across an edge the image is A + m_a x for x < 0 and B + m_b x for x > 0, blurred with all variances together S^2. The
second derivative vanishes at x = S^2 (m_b - m_a) / (B - A): shading shifts an edge by that. The variance of a point is
as 1 / (B - A)^2. A further step D anywhere near shifts it by at most exp(-1/2) S |D / (B - A)|.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.features.projected_edges import projected_edges, straight
from planner.imaging.projection import direction, edge_points, facing, project
from planner.models.locator import edge_blur
from render.build import polariser_axes
from render.phenomena.base import Influence, Poses, largest
from render.reflectance import NUMPY, brightness, indices, polarised_across
from scenes import Corner, Pose, Scene

NEAR_STEP = float(np.exp(-0.5))
_FRACTIONS = np.linspace(0.03, 0.97, 24)
_INWARD = 1e-3  # of the object's size: how far inside a face its slope is taken


class Sides(NamedTuple):
    """Both sides of E edges at n points in S settings; levels above darkness.

    ``levels``, ``slopes`` (grey levels a px, into the face) have shape (S, E, 2, n); ``lit``, whether the face is seen
    and turned to the light, too. ``points`` (cm, (E, n, 3)) and ``normals`` ((E, 2, 3)) say where.
    """

    levels: np.ndarray
    slopes: np.ndarray
    lit: np.ndarray
    points: np.ndarray
    normals: np.ndarray

    @property
    def contrast(self) -> np.ndarray:
        """B - A, shape (S, E, n)."""
        return self.levels[:, :, 1] - self.levels[:, :, 0]

    def shift(self, variance: float) -> np.ndarray:
        """Where shading puts the edge, px towards the second face, shape (S, E, n)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return variance * self.slopes.sum(2) / self.contrast


def sides(scene: Scene, poses: Poses, *, fall_off: bool = True) -> Sides:
    """Levels and slopes of a scene's required edges, unshadowed, before a black background."""
    solid, names = scene.solid, straight(scene)
    points = edge_points(solid, names, _FRACTIONS)
    faces = np.array([solid.edge(name).faces for name in names])
    inner = points[:, None] + _inward(scene, faces)[:, :, None]
    here = [_levels(scene, p, faces, poses, fall_off) for p in (np.broadcast_to(points[:, None], inner.shape), inner)]
    steps = np.stack(
        [
            np.linalg.norm(
                project(inner.reshape(-1, 3), sensor, scene.camera).reshape(*inner.shape[:-1], 2)
                - project(points.reshape(-1, 3), sensor, scene.camera).reshape(*points.shape[:-1], 2)[:, None],
                axis=-1,
            )
            for sensor in poses.sensors
        ]
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = (here[1] - here[0]) / steps
    lit = here[0] > 0
    return Sides(here[0], np.where(lit, slopes, 0.0), lit, points, solid.normals[faces])


def compare(scene: Scene, other: Scene, poses: Poses) -> Influence:
    """Bound of how two scenes' distances differ, their shading being all that differs."""
    variance = total_variance(scene)
    first, second = sides(scene, poses), sides(other, poses)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs((first.contrast / second.contrast) ** 2 - 1)
        ratio = np.maximum(ratio, np.abs((second.contrast / first.contrast) ** 2 - 1))
    moved = np.abs(first.shift(variance) - second.shift(variance)).max(-1)
    return largest((lever(scene, poses) * moved).sum(-1), ratio.max((-1, -2)))


def added_light(scene: Scene, poses: Poses, levels: np.ndarray, near: float) -> Influence:
    """Bound of what light added smoothly to either side (grey levels, shape (S, E, n)) does to the distance.

    ``near`` is the length (cm) over which it changes by its own size.
    """
    own = sides(scene, poses)
    share = np.abs(levels / np.where(own.contrast == 0, np.nan, own.contrast))
    slope = px_per_cm(scene, poses)[:, None, None] * near
    moved = (total_variance(scene) * share / slope).max(-1)
    return largest((lever(scene, poses) * moved).sum(-1), _loss(share).max((-1, -2)))


def near_steps(scene: Scene, poses: Poses, levels: np.ndarray) -> Influence:
    """Bound of what an edge of a further step (grey levels, shape (S, E, n)) anywhere near does to the distance."""
    share = np.abs(levels / np.where(sides(scene, poses).contrast == 0, np.nan, sides(scene, poses).contrast))
    moved = (NEAR_STEP * np.sqrt(total_variance(scene)) * share).max(-1)
    return largest((lever(scene, poses) * moved).sum(-1), _loss(share).max((-1, -2)))


def total_variance(scene: Scene) -> float:
    """S^2: of lens, pixel and the locator's smoothing, px^2."""
    return scene.locator.scale_px**2 + edge_blur(scene.camera.blur_px) ** 2


def px_per_cm(scene: Scene, poses: Poses) -> np.ndarray:
    """Image scale at the origin, shape (S,)."""
    return np.full(len(poses.sensors), scene.camera.focal_px / scene.camera.distance)


def lever(scene: Scene, poses: Poses) -> np.ndarray:
    """|d distance / d offset| of each required edge when all its points may move by up to 1 px, shape (S, E).

    Twice the response to a shift of the whole edge: extrapolating a fitted line from the points to its end at most
    doubles what moves them. For anything but a distance between two corners the plain bound 2.
    """
    if not all(isinstance(feature, Corner) for feature in scene.task.corners) or scene.task.kind != "distance":
        return np.full((len(poses.sensors), len(straight(scene))), 2.0)
    view = projected_edges(scene, poses.sensors)
    along = view.ends[..., 1, :] - view.ends[..., 0, :]
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    normals = np.stack([-along[..., 1], along[..., 0]], -1)
    start, end = (
        project(scene.solid.vertex(corner.vertex)[None], poses.sensors, scene.camera)[:, 0]
        for corner in scene.task.corners
    )
    unit = (end - start) / np.linalg.norm(end - start, axis=-1, keepdims=True)
    with np.errstate(all="ignore"):
        found = [
            np.abs(np.einsum("si,sij->sj", unit, np.linalg.pinv(np.nan_to_num(normals[:, k : k + 2])))) for k in (0, 2)
        ]
    return 2 * np.concatenate(found, -1)


def _loss(share: np.ndarray) -> np.ndarray:
    """Relative change of 1 / C^2 when the contrast may change by a share of it."""
    with np.errstate(divide="ignore"):
        return np.where(share < 1, 1 / np.maximum(1 - share, 1e-12) ** 2 - 1, np.inf)


def _inward(scene: Scene, faces: np.ndarray) -> np.ndarray:
    """Small steps (cm) from each edge into its two faces, shape (E, 2, 3)."""
    solid = scene.solid
    steps = []
    for name, pair in zip(straight(scene), faces, strict=True):
        ends = solid.vertices[list(solid.edge(name).ends)]
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        for face in pair:
            aside = np.cross(solid.normals[face], along)
            centre = solid.vertices[list(solid.faces[face])].mean(0)
            steps.append(aside * np.sign(aside @ (centre - ends[0])))
    return _INWARD * np.ptp(solid.vertices) * np.array(steps).reshape(-1, 2, 3)


def _levels(scene: Scene, points: np.ndarray, faces: np.ndarray, poses: Poses, fall_off: bool) -> np.ndarray:
    """Grey levels above darkness of points (E, 2, n, 3) on faces (E, 2), shape (S, E, 2, n)."""
    material, index = scene.material, indices(scene)
    normal = tuple(np.broadcast_to(scene.solid.normals[faces][:, :, None], points.shape)[..., i] for i in range(3))
    found = []
    for sensor, light in zip(poses.sensors, poses.lights, strict=True):
        places = scene.camera.distance * direction(sensor), scene.light.distance * direction(light)
        (to_sensor, _), (to_light, distance) = (_towards(points, place) for place in places)
        polarisation, analyser = polariser_axes(scene, Pose(*sensor), Pose(*light))
        polarisation = None if polarisation is None else polarised_across(NUMPY, tuple(polarisation), to_light)
        analyser = None if analyser is None else polarised_across(NUMPY, tuple(analyser), to_sensor)
        with np.errstate(all="ignore"):
            level = scene.camera.exposure * brightness(
                NUMPY, material, index, normal, to_light, to_sensor, polarisation, analyser
            )
        level = level * (scene.light.distance / distance) ** 2 if fall_off else level
        found.append(np.where(facing(scene.solid, places[0])[faces][..., None], level, 0.0))
    return np.stack(found)


def _towards(points: np.ndarray, place: np.ndarray) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    away = place - points
    distance = np.linalg.norm(away, axis=-1)
    return tuple((away / distance[..., None])[..., i] for i in range(3)), distance


def background(scene: Scene, poses: Poses, points: np.ndarray) -> np.ndarray:
    """Where the sensor sees the floor behind points (E, n, 3), cm; NaN where it does not, shape (S, E, n, 3)."""
    places = scene.camera.distance * direction(poses.sensors)[:, None, None]
    rays = points - places
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (scene.floor.height - places[..., 2]) / rays[..., 2]
    return np.where((reach > 0)[..., None], places + reach[..., None] * rays, np.nan)
