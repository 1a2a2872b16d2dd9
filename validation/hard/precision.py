"""The paper's model in a chosen floating-point type, to see where single precision is safe."""

from __future__ import annotations

import numpy as np

from scenes import Scene

_POINTS = 100
SAFE = 0.01  # relative error of a variance: a tenth of what 1000 noisy images tell


def paper_in(kind: type, scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """Variance of the distance in the image (eq. 3-10) of a convex diffuse solid, all arithmetic in one type.

    Moments about the mean, offsets relative to the image's middle: as stable as `planner` is.

    Parameters
    ----------
    kind : numpy.float32 or numpy.float64
    sensors, lights : ndarray, shape (n, 2)
        Degrees.

    Returns
    -------
    ndarray of that type, shape (n,)
        px^2; infinite where an edge is hidden or without contrast.
    """
    solid = scene.solid
    vertices, normals, offsets = (a.astype(kind) for a in (solid.vertices, solid.normals, solid.offsets))
    eye, right, down = _frame(sensors.astype(kind))
    lamp = kind(scene.lights[0].distance) * _frame(lights.astype(kind))[0]
    eye_height = kind(scene.camera.distance) * eye @ normals.T - offsets
    light_height = np.maximum(lamp @ normals.T - offsets, 0)
    albedo = scene.material.lambertian
    edge_on = 8 * np.finfo(kind).eps * scene.camera.distance
    level = np.where(eye_height > edge_on, light_height, 0) * kind(scene.camera.exposure * albedo)

    def image(points):
        depth = kind(scene.camera.distance) - eye @ points.T
        return kind(scene.camera.focal_px) * np.stack([right @ points.T, down @ points.T], -1) / depth[..., None]

    corners, total = image(vertices), kind(0)
    across = [corners[:, solid.vertex_names.index(corner.vertex)] for corner in scene.task.corners]
    pull = across[1] - across[0]
    with np.errstate(all="ignore"):
        pull = pull / np.linalg.norm(pull, axis=-1, keepdims=True)
        for at, corner in zip(across, scene.task.corners, strict=True):
            edges = [solid.edge(name) for name in corner.edges]
            normal = [_normal(corners[:, edge.ends[1]] - corners[:, edge.ends[0]]) for edge in edges]
            sine = normal[0][:, 0] * normal[1][:, 1] - normal[0][:, 1] * normal[1][:, 0]
            for edge, other in zip(edges, normal[::-1], strict=True):
                response = (pull[:, 0] * other[:, 1] - pull[:, 1] * other[:, 0]) / sine
                step = np.abs(level[:, edge.faces[0]] - level[:, edge.faces[1]])
                start, stop = vertices[list(edge.ends)]
                points = start + np.linspace(0, 1, _POINTS, dtype=kind)[:, None] * (stop - start)
                distance2 = ((lamp[:, None] - points) ** 2).sum(-1)
                weights = step[:, None] ** 2 / distance2 / kind(8.697 * scene.noise.sigma**2)
                total = total + response**2 * _line(weights, image(points), at)
        return np.where(np.isfinite(total), total, kind(np.inf)).astype(kind)


def _frame(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Away from the object, right and down, each (n, 3)."""
    polar, azimuth = np.radians(poses).T
    out = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    right = np.stack([-np.sin(azimuth), np.cos(azimuth), 0 * azimuth], -1)
    down = np.stack([np.cos(polar) * np.cos(azimuth), np.cos(polar) * np.sin(azimuth), -np.sin(polar)], -1)
    return out, right, down


def _normal(along: np.ndarray) -> np.ndarray:
    unit = along / np.linalg.norm(along, axis=-1, keepdims=True)
    return np.stack([-unit[:, 1], unit[:, 0]], -1)


def _line(weights: np.ndarray, places: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Variance of a line's offset at its corner, px^2, (n,), from its points' weights (n, p) and places (n, p, 2)."""
    total, kind = weights.sum(-1), weights.dtype.type
    mean = (weights[..., None] * places).sum(1) / total[:, None]
    away = places - mean[:, None]
    spread = (weights * (away**2).sum(-1)).sum(-1) / total * kind(_POINTS / (_POINTS - 1))
    bar = total * kind((_POINTS - 1) / _POINTS)
    tilt = (spread + kind(_POINTS) / total) / (bar * spread**2)
    return (((at - mean) ** 2).sum(-1) + 1 / total) * tilt + 1 / total


def error_of_single(scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """Relative error of single precision; NaN where neither measures, infinite where only one does."""
    single, double = (paper_in(kind, scene, sensors, lights).astype(float) for kind in (np.float32, np.float64))
    with np.errstate(invalid="ignore"):
        error = np.abs(single / double - 1)
    alone = np.isfinite(single) != np.isfinite(double)
    return np.where(np.isfinite(double), np.where(alone, np.inf, error), np.where(alone, np.inf, np.nan))
