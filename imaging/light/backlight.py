"""Lights that the sensor sees behind the object."""

from __future__ import annotations

import numpy as np

from imaging.geometry.projection import frame
from imaging.light.illumination import dimming
from imaging.light.irradiance import electric_field, widened
from imaging.pictures import Pictures
from scenes import Scene


def backlights(scene: Scene) -> tuple[int, ...]:
    """Which of a scene's lights are seen by its sensor."""
    return tuple(i for i, light in enumerate(scene.lights) if light.faces_sensor and light.intensity > 0)


def backlit(
    pictures: Pictures, which: int, points: np.ndarray, vectors: np.ndarray, analyser: np.ndarray | None
) -> np.ndarray:
    """Signal that a sensor has of a backlight along rays past points, grey levels, shape (..., n); 0 beside it.

    Parameters
    ----------
    which : int
        Which of the lights.
    points, vectors : ndarray, shape (..., n, 3)
        The ray is point + t vector, t > 0; scene units.
    analyser : ndarray, shape (..., 3), optional
        What the analyser passes: half of unpolarised light, else the squared cosine (Malus).
    """
    scene, light = pictures.scene, pictures.scene.lights[which]
    axes = frame(pictures.lights[which])
    normal, right, down = (widened(axis, 1) for axis in (axes.forward, axes.right, axes.down))
    towards = (vectors * normal).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        away = widened(pictures.lights_at[which], 1) - points
        t = (away * normal).sum(-1) / towards
        place = t[..., None] * vectors - away
        cosine = -towards / np.linalg.norm(vectors, axis=-1)
        shown = light.seen_at((place * right).sum(-1), (place * down).sum(-1), cosine) * (t > 0)
    shown = shown * dimming(pictures, points + vectors, 1)
    return shown * scene.camera.exposure * light.intensity * passed(pictures, which, analyser)


def passed(pictures: Pictures, which: int, analyser: np.ndarray | None) -> np.ndarray | float:
    """Part of its light that the analyser passes."""
    angle = pictures.scene.lights[which].polarisation_deg
    if analyser is None:
        return 1.0
    if angle is None:
        return 0.5
    axis = electric_field(pictures.lights_at[which] - np.array(pictures.scene.camera.look_at), angle)
    return ((analyser * axis).sum(-1) ** 2)[..., None]
