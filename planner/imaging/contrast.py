"""Brightness on both sides of an edge and the contrast across it (eq. 8-10)."""

from __future__ import annotations

import numpy as np

from planner.imaging.illumination import level as grey_level
from planner.imaging.projection import direction, edge_points, facing
from planner.imaging.rays import first_face, reaches
from planner.imaging.visibility import seen, turned
from scenes import Scene, Solid


def side_levels(
    scene: Scene, edges: tuple[str, ...], points: np.ndarray, sensors: np.ndarray, lights: np.ndarray, *, fall_off: bool
) -> np.ndarray:
    """Grey level above darkness on the two sides of each edge.

    A side is the face that meets in the edge; where that face turns away from the sensor, it is whatever the
    sensor sees behind the edge: another face of the object, or the dark background.

    Parameters
    ----------
    edges : tuple of str
        E edge names.
    points : ndarray, shape (E, n, 3) or (..., E, n, 3)
        Points on the edges, cm; the same for all poses or for each its own.
    sensors, lights : ndarray, shape (..., 2)
        Poses in degrees, broadcast against each other.
    fall_off : bool
        Whether irradiance falls with the squared distance from the light, as it physically does; the
        paper's eq. 1 has no such term.

    Returns
    -------
    ndarray, shape (..., E, 2, n)
        Exactly 0 for a side that is dark: background, turned away from the light, or in shadow. Both are 0 at a point
        that is hidden from the sensor. Grey levels; the exposure is the level of a white diffuse surface at the origin.
    """
    solid = scene.solid
    faces = np.array([solid.edge(name).faces for name in edges])
    sensor_at, light_at = scene.camera.distance * direction(sensors), scene.light.distance * direction(lights)
    normals = solid.normals[faces][:, :, None]
    level = _level(scene, points[..., None, :, :], normals, sensor_at, light_at, fall_off)
    if solid.is_convex:
        return np.where(facing(solid, sensor_at)[..., faces, None], level, 0.0)
    shape = level.shape
    parts = [
        _beside(scene, name, points[..., i, :, :], level[..., i, :, :], sensor_at, light_at, fall_off)
        for i, name in enumerate(edges)
    ]
    return np.stack(parts, -3).reshape(shape)


def squared_contrast(
    scene: Scene, edges: tuple[str, ...], fractions: np.ndarray, sensors: np.ndarray, lights: np.ndarray,
    *, fall_off: bool,
) -> np.ndarray:  # fmt: skip
    """Squared contrast at fractions (n,) or (..., E, n) of each edge's length in space, shape (..., E, n).

    On a plane, diffuse face N.(l - p) is the same for all points p, so with r the distance |l - p| the level is a
    constant over r (or r^3 with fall-off): on a convex diffuse solid the contrast is one number an edge over r.
    """
    if not (scene.solid.is_convex and scene.material.is_diffuse):
        points = edge_points(scene.solid, edges, fractions)
        return contrast(side_levels(scene, edges, points, sensors, lights, fall_off=fall_off)) ** 2
    step = step_on_unit_sphere(scene, edges, sensors, lights)
    r2 = squared_distance(scene, edges, fractions, lights)
    return (step**2)[..., None] * (scene.light.distance**4 / r2**3 if fall_off else 1 / r2)


def step_on_unit_sphere(scene: Scene, edges: tuple[str, ...], sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """Contrast times distance from the light, grey levels cm, of a convex diffuse solid; shape (..., E)."""
    solid, material = scene.solid, scene.material
    faces = np.array([solid.edge(name).faces for name in edges])
    seen_faces = facing(solid, scene.camera.distance * direction(sensors))
    height = np.maximum(scene.light.distance * direction(lights) @ solid.normals.T - solid.offsets, 0.0)
    white = scene.camera.exposure * (1 - material.specular_fraction) * material.diffuse_reflectance
    side = (np.where(seen_faces, height, 0.0) * white)[..., faces]
    return np.abs(side[..., 0] - side[..., 1])


def squared_distance(scene: Scene, edges: tuple[str, ...], fractions: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """Squared distance of the light from points on the edges, cm^2, shape (..., E, n)."""
    ends = np.array([scene.solid.vertices[list(scene.solid.edge(name).ends)] for name in edges])
    along = ends[:, 1] - ends[:, 0]
    light_at = scene.light.distance * direction(lights)
    start = scene.light.distance**2 - 2 * light_at @ ends[:, 0].T + (ends[:, 0] ** 2).sum(-1)
    slope = np.einsum("ei,ei->e", ends[:, 0], along) - light_at @ along.T
    return start[..., None] + fractions * (2 * slope[..., None] + fractions * (along**2).sum(-1)[:, None])


def contrast(levels: np.ndarray) -> np.ndarray:
    """Absolute difference of the two sides (eq. 10): (..., E, 2, n) becomes (..., E, n)."""
    return np.abs(levels[..., 0, :] - levels[..., 1, :])


def _level(scene, points, normals, sensor_at, light_at, fall_off) -> np.ndarray:
    """Grey level of points (..., E, k, n, 3) with normals that broadcast, seen and lit freely."""
    to_light, light_distance = _towards(points, light_at[..., None, None, None, :])
    to_sensor, _ = _towards(points, sensor_at[..., None, None, None, :])
    level = grey_level(scene, normals, to_light, to_sensor, light_at[..., None, None, None, :])
    return level * (scene.light.distance / light_distance) ** 2 if fall_off else level


def _beside(scene, name, points, level, sensor_at, light_at, fall_off) -> np.ndarray:
    """The two sides (..., 2, n) of one edge of a solid that may hide and shadow itself."""
    solid, edge = scene.solid, scene.solid.edge(name)
    fractions = _fractions(solid, edge, points)
    lit = turned(solid, edge, light_at)[..., None] & seen(solid, edge, light_at, fractions)[..., None, :]
    looked_at = turned(solid, edge, sensor_at)[..., None]
    visible = (looked_at.any(-2) & seen(solid, edge, sensor_at, fractions))[..., None, :]
    found = np.where(visible & looked_at & lit, level, 0.0)
    for side, face in enumerate(edge.faces):
        # past an outer face that is turned away there is nothing, for the ray leaves the convex hull
        wanted = visible[..., 0, :] & ~looked_at[..., side, :]
        if not solid.outer[face] and wanted.any():
            past = behind(scene, points, sensor_at, light_at, wanted, edge.faces, fall_off)
            found[..., side, :] = np.where(wanted, past, found[..., side, :])
    return found


def behind(scene: Scene, points, sensor_at, light_at, wanted, own: tuple[int, ...], fall_off: bool) -> np.ndarray:
    """Grey level of what the sensor sees just past points of an edge.

    Parameters
    ----------
    points : ndarray, shape (..., n, 3)
        cm.
    sensor_at, light_at : ndarray, shape (..., 3)
        Positions, cm.
    wanted : ndarray of bool, shape (..., n)
        For which points; the others get 0.
    own : tuple of int
        Faces that meet in the edge.

    Returns
    -------
    ndarray, shape (..., n)
        0 where the ray meets nothing, or what it meets is dark.
    """
    solid, sensor_at, light_at = scene.solid, sensor_at[..., None, :], light_at[..., None, :]
    vectors = points - sensor_at
    asked = np.broadcast_to(wanted, np.broadcast_shapes(wanted.shape, vectors.shape[:-1]))
    asked = asked.any(tuple(i for i, size in enumerate(vectors.shape[:-1]) if size < asked.shape[i]), keepdims=True)
    face, t = np.full(vectors.shape[:-1], -1), np.zeros(vectors.shape[:-1])
    face[asked], t[asked] = first_face(solid, np.broadcast_to(points, vectors.shape)[asked], vectors[asked], own)
    hit = points + np.where(face >= 0, t, 0.0)[..., None] * vectors
    to_light, distance = _towards(hit, light_at)
    normals = solid.normals[face]
    level = grey_level(scene, normals, to_light, _towards(hit, sensor_at)[0], light_at)
    bright = wanted & (face >= 0) & (level > 0)
    places = [np.broadcast_to(place, (*bright.shape, 3))[bright] for place in (hit, light_at)]
    bright[bright] = reaches(solid, places[0], np.broadcast_to(face, bright.shape)[bright], places[1])
    return np.where(bright, level * (scene.light.distance / distance) ** 2 if fall_off else level, 0.0)


def _fractions(solid: Solid, edge, points: np.ndarray) -> np.ndarray:
    start, stop = solid.vertices[list(edge.ends)]
    return (points - start) @ (stop - start) / ((stop - start) @ (stop - start))


def _towards(points: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors from points to positions, and distances."""
    away = positions - points
    distance = np.linalg.norm(away, axis=-1)
    return away / distance[..., None], distance
