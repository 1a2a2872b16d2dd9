"""Light that meets more than one surface: cast shadow, floor, interreflection."""

from __future__ import annotations

import numpy as np

from imaging.features.projected_edges import circles
from imaging.light.appearance import floor_material, signal
from imaging.pictures import Pictures
from render.phenomena.base import EVERYTHING, NOTHING, Effect, Influence
from render.phenomena.edges import added_light, background, near_steps, sides
from scenes import Scene, Solid


class CastShadow(Effect):
    """One body keeps the light from another, or from the floor."""

    name = "cast_shadow"
    switch = "obstacles in the scene; every hit is tested against the light anyway, so it costs nothing"

    def absent(self, pictures: Pictures) -> str | None:
        return "one convex body before darkness: nothing to fall on" if _alone(pictures.scene) else None

    def influence(self, pictures: Pictures) -> Influence:
        """Everything where a body hides a required edge from the light; the floor's own step otherwise."""
        scene = pictures.scene
        if not scene.solid.is_convex:
            return EVERYTHING
        lights = np.concatenate([emitter.at.reshape(-1, 3) for emitter in pictures.emitters])
        points = sides(pictures).points.reshape(-1, 3)
        for obstacle in scene.obstacles:
            if any(_hides(obstacle.solid, points, light).any() for light in lights):
                return EVERYTHING
        return near_steps(pictures, _floor_levels(pictures)) if scene.floor else NOTHING

    def without(self, scene: Scene) -> Scene:
        return scene.model_copy(update={"obstacles": ()})


class FloorReflectance(Effect):
    """A floor that is not black: the background of the outer edges."""

    name = "floor"
    cost = 2.5
    switch = "a plane below the object; the whole frame is rendered"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        if scene.floor is None:
            return "there is no floor"
        return "the floor is black" if scene.floor.reflectance == 0 else None

    def influence(self, pictures: Pictures) -> Influence:
        return near_steps(pictures, _floor_levels(pictures))

    def without(self, scene: Scene) -> Scene:
        return scene.model_copy(update={"floor": None})


class Interreflection(Effect):
    """Light that one surface sends to another."""

    name = "interreflection"
    cost = 25.0
    random = True
    has_formula = False
    switch = "the path integrator instead of the direct one; random, so edge pixels cannot be singled out"

    def absent(self, pictures: Pictures) -> str | None:
        return "one convex body before darkness: no surface sees another" if _alone(pictures.scene) else None

    def influence(self, pictures: Pictures) -> Influence:
        """From form factors: F of a face to a floor is at most (1 - n_z) / 2, to an obstacle sin^2 of its height.

        Not bounded at the rim of a hole, whose wall sees itself right beside the rim.
        """
        scene = pictures.scene
        if any(scene.solid.circle(name).hole for name in circles(scene)):
            return EVERYTHING
        own, white, bodies = sides(pictures), albedo(scene), _bodies(scene)
        reflectance = scene.floor.reflectance if scene.floor else 0.0
        down = np.broadcast_to(((1 - own.normals[..., 2]) / 2)[..., None], own.levels.shape[1:])
        brightest = scene.camera.exposure * _gain(scene)
        rest = [_form_factor(body, own.points, own.normals) for body in bodies]
        to_solids = np.minimum(sum(rest), 1.0) if rest else np.zeros(own.levels.shape[1:])
        multiple = 1 / (1 - white * max(reflectance, white if bodies else 0.0) * 0.5)
        faces = white * (down * reflectance + to_solids * white) * brightest
        behind = reflectance * 0.5 * white * brightest
        levels = multiple * (faces.max(1) + behind)
        near = min([_clearance(own.points, body) for body in bodies] + _above_floor(scene, own.points))
        return added_light(pictures, np.broadcast_to(levels, own.contrast.shape), max(near, 1e-3))


def _alone(scene: Scene) -> bool:
    """Whether the object is one convex body before darkness."""
    return not _bodies(scene) and scene.bright_floor is None


def _bodies(scene: Scene) -> list[Solid]:
    """What stands in the way of light: the obstacles, and the object itself if it is hollow."""
    return [obstacle.solid for obstacle in scene.obstacles] + ([] if scene.solid.is_convex else [scene.solid])


def albedo(scene: Scene) -> float:
    """At most this part of the light is sent on."""
    return max(material.lambertian + material.lobe_reflectance for material in scene.surfaces.used)


def _gain(scene: Scene) -> float:
    """Irradiance near the object is at most this times what the camera's exposure stands for."""
    reach = float(np.linalg.norm(scene.solid.vertices - np.array(scene.camera.look_at), axis=1).max())
    gains = (light.intensity / max(1 - reach / light.distance, 0.05) ** 2 for light in scene.lights)
    return float(sum(gains))


def _floor_levels(pictures: Pictures) -> np.ndarray:
    """Unshadowed level of the floor behind each edge point, shape (S, E, n); 0 where the floor is not seen."""
    scene, points = pictures.scene, background(pictures, sides(pictures).points)
    level = signal(pictures, points, np.array([0.0, 0.0, 1.0]), 2, material=floor_material(scene.floor))
    inside = (np.abs(points[..., :2]) <= scene.floor.half_side).all(-1)
    return np.where(inside, np.nan_to_num(level), 0.0)


def _hides(solid: Solid, points: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Whether a convex solid cuts the way from points (m, 3) to the light, by clipping the ray at each plane."""
    ray = light - points
    height = points @ solid.normals.T - solid.offsets
    rate = ray @ solid.normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -height / rate
    enter = np.where(rate < 0, at, np.where((rate == 0) & (height > 0), np.inf, -np.inf)).max(1)
    leave = np.where(rate > 0, at, np.inf).min(1)
    return np.maximum(enter, 1e-9) < np.minimum(leave, 1.0)


def _form_factor(solid: Solid, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Bound of the form factor from faces at points (E, n, 3) of normals (E, 2, 3) to a solid, shape (E, 2, n).

    A solid lies below its highest vertex' elevation e over the face's plane; such directions make up sin^2 e.
    """
    away = solid.vertices - points[:, :, None]
    sine = np.einsum("envi,efi->efnv", away, normals) / np.linalg.norm(away, axis=-1)[:, None]
    return np.clip(sine, 0, 1).max(-1) ** 2


def _clearance(points: np.ndarray, solid: Solid) -> float:
    """Distance from points to the nearest plane of a solid that they lie outside of, scene units; a lower bound."""
    height = points.reshape(-1, 3) @ solid.normals.T - solid.offsets
    return float(np.clip(height.max(1), 0, None).min())


def _above_floor(scene: Scene, points: np.ndarray) -> list[float]:
    return [float(points[..., 2].min() - scene.floor.height)] if scene.floor else []
