"""Brightness on both sides of an edge and the contrast across it (eq. 8-10)."""

from __future__ import annotations

import numpy as np

from planner.reflectance import reflected
from planner.view import direction, facing
from scenes import Scene


def side_levels(
    scene: Scene, edges: tuple[str, ...], points: np.ndarray, sensors: np.ndarray, lights: np.ndarray, *, fall_off: bool
) -> np.ndarray:
    """Grey level above darkness on the two faces that meet in each edge.

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
        Exactly 0 for a face that the sensor cannot see (the dark background is there) or that faces away
        from the light. Grey levels; the exposure is the level of a white diffuse surface at the origin.
    """
    solid, camera = scene.solid, scene.camera
    faces = np.array([solid.edge(name).faces for name in edges])
    normals = solid.normals[faces][:, :, None]
    sensor_positions = camera.distance * direction(sensors)
    to_light, light_distance = _towards(points, scene.light.distance * direction(lights))
    to_sensor, _ = _towards(points, sensor_positions)
    level = camera.exposure * reflected(scene.material, normals, to_light[..., None, :, :], to_sensor[..., None, :, :])
    if fall_off:
        level = level * (scene.light.distance / light_distance[..., None, :]) ** 2
    return np.where(facing(solid, sensor_positions)[..., faces, None], level, 0.0)


def contrast(levels: np.ndarray) -> np.ndarray:
    """Absolute difference of the two sides (eq. 10): (..., E, 2, n) becomes (..., E, n)."""
    return np.abs(levels[..., 0, :] - levels[..., 1, :])


def _towards(points: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors from points (..., E, n, 3) to positions (..., 3), and distances: (..., E, n, 3) and (..., E, n)."""
    away = positions[..., None, None, :] - points
    distance = np.linalg.norm(away, axis=-1)
    return away / distance[..., None], distance
