"""The light on the object, as eq. 1 needs it: its polarisation, and its wavelengths as the sensor weighs them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.imaging.reflectance import reflected
from scenes import Scene


@dataclass(frozen=True)
class Band:
    """A wavelength's refractive index n - ik and its share of the grey level of a white diffuse surface."""

    refractive_index: float
    extinction: float
    share: float


def bands(scene: Scene) -> tuple[Band, ...]:
    """The spectral sum of eq. 1: C S Q by the trapezium rule at the wavelengths of the material's table.

    Shares add up to 1, so that the exposure keeps its meaning: the grey level of a white diffuse surface.
    One band without a table, for then nothing depends on the wavelength.
    """
    material = scene.material
    if not material.index_table:
        return (Band(material.refractive_index, material.extinction, 1.0),)
    wavelength, n, k = np.array(material.index_table).T
    width = np.gradient(wavelength) if len(wavelength) > 2 else np.ones(len(wavelength))
    width[[0, -1]] = np.diff(wavelength)[[0, -1]] / 2 if len(wavelength) > 2 else 1.0
    share = width.copy()
    for curve in (scene.camera.transmission, scene.camera.responsivity, scene.light.spectrum):
        if curve:
            share *= np.interp(wavelength, *np.array(curve).T)
    share /= share.sum()
    return tuple(Band(*map(float, row)) for row in zip(n, k, share, strict=True))


def level(
    scene: Scene, normals: np.ndarray, to_light: np.ndarray, to_sensor: np.ndarray, light_at: np.ndarray
) -> np.ndarray:
    """Grey level of surface points under the scene's light, without fall-off with distance (eq. 1).

    Parameters
    ----------
    normals, to_light, to_sensor : ndarray, shape (..., 3)
        Unit vectors N, L and V.
    light_at : ndarray, shape (..., 3)
        The light's position, cm; its direction from the object's origin sets the plane of polarisation.

    Returns
    -------
    ndarray, shape (...)
        The exposure for a white diffuse surface that faces the light.
    """
    angle = scene.light.polarisation_deg
    if scene.material.is_diffuse:
        return scene.camera.exposure * reflected(scene.material, normals, to_light, to_sensor)
    field = None if angle is None else electric_field(light_at, angle)
    return scene.camera.exposure * sum(
        band.share
        * reflected(scene.material, normals, to_light, to_sensor, field, index=(band.refractive_index, band.extinction))
        for band in bands(scene)
    )


def electric_field(light_at: np.ndarray, angle_deg: float) -> np.ndarray:
    """Unit vector of the electric field of linearly polarised light, shape (..., 3).

    ``angle_deg`` is measured from the vertical plane through the light (at the poles, from the x axis) towards rising
    azimuth.
    """
    ray = light_at / np.linalg.norm(light_at, axis=-1, keepdims=True)
    across = np.hypot(ray[..., 0], ray[..., 1])
    pole = across < 1e-12
    safe = np.where(pole, 1.0, across)
    cosine, sine = np.where(pole, 1.0, ray[..., 0] / safe), np.where(pole, 0.0, ray[..., 1] / safe)
    down = np.stack([ray[..., 2] * cosine, ray[..., 2] * sine, -across], -1)
    right = np.stack([-sine, cosine, np.zeros_like(sine)], -1)
    angle = np.radians(angle_deg)
    return np.cos(angle) * down + np.sin(angle) * right
