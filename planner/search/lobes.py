"""How bright the lobes of glossy faces can be, whichever of some sensors near each other looks.

A lobe (`scenes.Brdf.lobe_range`) is bounded where directions to light and to sensor are known to angles: of lights to
what a piece of an edge, or a face, subtends from them, of sensors to what they are apart as well. Of unit vectors whose
sum is a, moved by no more than D together, the half vector moves by no more than 2 D / (2 |a| - D).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from imaging.geometry.projection import direction, viewpoint
from imaging.light.irradiance import bands
from scenes import Brdf, Luminaire, Scene
from scenes.materials.vectors import length


class Around(NamedTuple):
    """Places that lie near each other: points (..., 3), and how far from these the places are at most, scene units."""

    middles: np.ndarray
    radii: np.ndarray


class Shining(NamedTuple):
    """A light, its places (L, 3), scene units, and its power (`Emitter`)."""

    light: Luminaire
    at: np.ndarray
    power: float


@dataclass(frozen=True, eq=False)
class Lobes:
    """Bounds for a scene's lights and some sensors.

    Attributes
    ----------
    scene : Scene
    shining : list of Shining
    sensors : ndarray, shape (n, 2)
        Degrees.
    """

    scene: Scene
    shining: list[Shining]
    sensors: np.ndarray

    def of(self, face: int, where: Around) -> tuple[np.ndarray, np.ndarray]:
        """The lowest and the highest signals of a face's lobe by all lights together, at places (k,): each (L, k), or
        (1, k) of a matt one. Of several lights each may be in shadow; infinite where nothing is known.
        """
        material, bodies = self.scene.surfaces.of(face), self.scene.bodies
        if material.is_diffuse:
            return (np.zeros((1, len(where.radii))),) * 2
        to_sensor = self._to_sensors(where)
        normal = bodies.normals[face] if bodies.plane[face] else None
        each = [self._by(light, material, normal, where, *to_sensor) for light in self.shining]
        least, most = (sum(parts) for parts in zip(*each, strict=True))
        return least if len(self.shining) == 1 else np.zeros_like(least), most

    def _to_sensors(self, where: Around) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors (k, 3), and how far from them the directions to sensors are at most, radians, (k,)."""
        towards = viewpoint(self.scene.camera, self.sensors).widened(1).towards(where.middles)
        away = length(towards)
        towards = towards / away[..., None]
        mean = towards.mean(0)
        mean /= length(mean)[:, None]
        share = self.scene.camera.perspective
        return mean, (_angle(towards, mean) + _subtended(abs(share) * where.radii, away)).max(0)

    def _by(
        self,
        shining: Shining,
        material: Brdf,
        normal: np.ndarray | None,
        where: Around,
        to_sensor: np.ndarray,
        off: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Of one light, each (L, k); of a face that is not plane the normal is anywhere."""
        camera, light = self.scene.camera, shining.light
        towards = shining.at[:, None] - where.middles
        away = length(towards)
        towards, beside = towards / away[..., None], _subtended(where.radii, away)
        both, moved = towards + to_sensor, beside + off
        size = length(both)
        with np.errstate(all="ignore"):
            turn = 2 * np.arcsin(np.clip(moved / (2 * size - moved), 0, 1))
            turn = np.where(2 * size > moved, turn, np.pi)
            facing = np.maximum(size - moved, 0) / 2, np.minimum(size + moved, 2) / 2
            least, most = material.lobe_range(
                bands(self.scene, light, material),
                _about(both / size[..., None], normal, turn),
                facing,
                _cosines(_about(towards, normal, beside)),
                _cosines(_about(to_sensor, normal, off)),
                (light.polarisation_deg is not None, camera.analyser_deg is not None),
            )
            bright, far, near = camera.exposure * shining.power, away + where.radii, away - where.radii
            return bright * least / far**2, np.where(near > 0, bright * most / near**2, np.inf)


def _about(way: np.ndarray, normal: np.ndarray | None, by: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least and the greatest angle to a normal, radians, of unit vectors that are known to an angle."""
    if normal is None:
        return np.zeros(by.shape), np.full(by.shape, np.pi)
    at = np.nan_to_num(_angle(way, normal), nan=np.pi / 2)
    return np.maximum(at - by, 0), np.minimum(at + by, np.pi)


def _cosines(angles: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The least and the greatest."""
    return np.cos(angles[1]), np.cos(angles[0])


def together(scene: Scene, sensors: np.ndarray, apart: float) -> np.ndarray:
    """Which of the sensors (S, 2) look from nearly the same side, numbers (S,): their directions, unit vectors, are in
    one cube so wide. All, where every face is matt."""
    if scene.surfaces.is_diffuse:
        return np.zeros(len(sensors), int)
    return np.unique(np.round(direction(sensors) / apart), axis=0, return_inverse=True)[1].ravel()


def _angle(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Between unit vectors (..., 3), radians; exact near 0, too."""
    return 2 * np.arcsin(np.minimum(length(first - second) / 2, 1.0))


def _subtended(radii: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Half of the angle, radians, under which balls are seen from some distance; pi from within."""
    with np.errstate(all="ignore"):
        return np.where(away > radii, np.arcsin(np.minimum(radii / away, 1.0)), np.pi)
