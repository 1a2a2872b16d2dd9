"""The shape of a face's brightness, known where the light is: it frees the estimators from having to learn it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from planner.imaging.projection import project
from planner.imaging.reflectance import reflected
from scenes import Pose, Scene

_DEGREE = 3
_GRID = np.linspace(0.02, 0.98, 7)


class Shading:
    """Brightness across a face relative to its mean, a cubic in the image; 1 everywhere if nothing is known.

    Parameters
    ----------
    points : ndarray, shape (k, 2)
        Places in the image, px.
    levels : ndarray, shape (k,)
        Brightness there.
    """

    def __init__(self, points: np.ndarray, levels: np.ndarray) -> None:
        self.middle, self.reach = points.mean(0), np.abs(points - points.mean(0)).max() or 1.0
        self.coefficients = np.linalg.lstsq(self._terms(points), levels / levels.mean(), rcond=None)[0]
        self.residual = float(np.abs(self._terms(points) @ self.coefficients - levels / levels.mean()).max())

    @classmethod
    def uniform(cls, corners: np.ndarray) -> Shading:
        """No shading at all on a convex polygon (k, 2)."""
        points = _spread(corners)
        return cls(points, np.ones(len(points)))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Relative brightness at places (..., 2), px."""
        return self._terms(points) @ self.coefficients

    def _terms(self, points: np.ndarray) -> np.ndarray:
        x, y = np.moveaxis(np.clip((points - self.middle) / self.reach, -2, 2), -1, 0)
        return np.stack([x**i * y**j for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)], -1)


def face_shadings(scene: Scene, sensor: Pose, light: Pose) -> list[Shading | None]:
    """The shading of each face of the object; None for a face that the light or the sensor does not reach."""
    eye, lamp = scene.position("sensor", sensor), scene.position("light", light)
    found: list[Shading | None] = []
    for normal, face in zip(scene.solid.normals, scene.solid.faces, strict=True):
        points = _spread(scene.solid.vertices[list(face)])
        to_light, to_eye = lamp - points, eye - points
        distance = np.linalg.norm(to_light, axis=1, keepdims=True)
        levels = reflected(
            scene.material, normal, to_light / distance, to_eye / np.linalg.norm(to_eye, axis=1, keepdims=True)
        )
        levels = levels * (scene.light.distance / distance[:, 0]) ** 2
        image = project(points, np.array(list(sensor)), scene.camera)
        found.append(Shading(image, levels) if levels.min() > 0 and np.isfinite(image).all() else None)
    return found


def _spread(corners: np.ndarray) -> np.ndarray:
    """Points spread over a convex polygon: each triangle of a fan, on a grid."""
    u, v = (part.ravel() for part in np.meshgrid(_GRID, _GRID))
    first, u, v = corners[0], u[:, None], v[:, None]
    return np.concatenate([first + u * ((1 - v) * (a - first) + v * (b - first)) for a, b in pairwise(corners[1:])])
