"""The shape of a face's brightness, known where the light is: it frees the estimators from having to learn it."""

from __future__ import annotations

import numpy as np

from imaging.blurred.arrangement import spread
from imaging.geometry.projection import project_ideal
from imaging.light.appearance import face_signal
from imaging.pictures import Pictures

_DEGREE = 3


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
        points = spread(corners)
        return cls(points, np.ones(len(points)))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Relative brightness at places (..., 2), px."""
        return self._terms(points) @ self.coefficients

    def _terms(self, points: np.ndarray) -> np.ndarray:
        x, y = np.moveaxis(np.clip((points - self.middle) / self.reach, -2, 2), -1, 0)
        return np.stack([x**i * y**j for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)], -1)


def face_shadings(pictures: Pictures) -> list[Shading | None]:
    """The shading of each face of object and obstacles; None for one that the lights or the sensor do not reach."""
    scene, found = pictures.scene, []
    for number, face in enumerate(scene.bodies.faces):
        points = spread(scene.bodies.vertices[list(face)])
        levels = face_signal(pictures, points, number, 1)
        image = project_ideal(points, pictures.sensors, scene.camera)
        found.append(Shading(image, levels) if levels.min() > 0 and np.isfinite(image).all() else None)
    return found
