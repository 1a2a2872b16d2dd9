"""The light that arrives at points of the scene: its direction, its strength, its polarisation, its wavelengths.

What lights are is in `scenes.lights`, what surfaces make of it in `scenes.materials`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imaging.light.emitters import Emitter
from scenes import Brdf, Luminaire, Scene
from scenes.materials.brdf import Index
from scenes.materials.vectors import dot


class Beam(NamedTuple):
    """Light that arrives at points from one direction.

    Attributes
    ----------
    to_light : ndarray, shape (..., 3)
        Unit vector towards where it comes from.
    strength : ndarray, shape (...) or float
        Irradiance across the beam over that at the reference point.
    """

    to_light: np.ndarray
    strength: np.ndarray | float


def beam(emitter: Emitter, points: np.ndarray, axes: int = 0, *, fall_off: bool = True) -> Beam:
    """What an emitter sends to points (..., 3), scene units; with ``fall_off`` by the inverse square.

    ``axes`` is how many axes the points have of their own, behind those of the pictures.
    """
    to_light, distance = _directions(widened(np.asarray(emitter.at), axes), points)
    strength = emitter.power / (distance if fall_off else emitter.distance) ** 2
    if emitter.axis is not None:
        strength = strength * emitter.light.profile(-(to_light * widened(np.asarray(emitter.axis), axes)).sum(-1))
    return Beam(to_light, strength)


def _directions(place: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (..., 3) from points (..., 3) towards a place, and distances (...): a component at a time, which
    NumPy does two times as fast."""
    away = [place[..., i] - points[..., i] for i in range(3)]
    distance = np.sqrt(dot(away, away))
    found = np.empty((*distance.shape, 3))
    for i, each in enumerate(away):
        np.divide(each, distance, out=found[..., i])
    return found, distance


def widened(values: np.ndarray, axes: int) -> np.ndarray:
    """Vectors (..., 3) with some axes of length 1 before the last."""
    return values.reshape(*values.shape[:-1], *[1] * axes, values.shape[-1])


def squared_distance(starts: np.ndarray, stops: np.ndarray, fractions: np.ndarray, light_at: np.ndarray) -> np.ndarray:
    """Squared distance of a light (..., 3) from points at fractions of the segments (E, 3), shape (..., E, n)."""
    along = stops - starts
    start = (light_at**2).sum(-1, keepdims=True) - 2 * light_at @ starts.T + (starts**2).sum(-1)
    slope = np.einsum("ei,ei->e", starts, along) - light_at @ along.T
    return start[..., None] + fractions * (2 * slope[..., None] + fractions * (along**2).sum(-1)[:, None])


def electric_field(beam_axis: np.ndarray, angle_deg: float) -> np.ndarray:
    """Unit vector of the electric field of linearly polarised light, shape (..., 3).

    Parameters
    ----------
    beam_axis : ndarray, shape (..., 3)
        From the reference point to the light.
    angle_deg : float
        From the vertical plane through the light (at the poles, from the x axis) towards rising azimuth.
    """
    ray = beam_axis / np.linalg.norm(beam_axis, axis=-1, keepdims=True)
    across = np.hypot(ray[..., 0], ray[..., 1])
    pole = across < 1e-12
    safe = np.where(pole, 1.0, across)
    cosine, sine = np.where(pole, 1.0, ray[..., 0] / safe), np.where(pole, 0.0, ray[..., 1] / safe)
    down = np.stack([ray[..., 2] * cosine, ray[..., 2] * sine, -across], -1)
    right = np.stack([-sine, cosine, np.zeros_like(sine)], -1)
    angle = np.radians(angle_deg)
    return np.cos(angle) * down + np.sin(angle) * right


def bands(scene: Scene, light: Luminaire | None = None, material: Brdf | None = None) -> tuple[Index, ...]:
    """What a material's lobe is summed over (`Brdf.indices`): the scene's own where not given, its first light."""
    curves = scene.camera.transmission, scene.camera.responsivity, (light or scene.lights[0]).spectrum
    return (material or scene.material).indices(curves)
