"""Lights as Mitsuba's emitters, and what the paper's reflectance has to know of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from imaging.geometry.projection import Frame, light_frame, light_position
from imaging.light.appearance import analyser_axis, polarisation_axis
from imaging.light.backlight import passed
from imaging.light.emitters import reach_of
from imaging.pictures import Pictures
from render.bsdf import PolarisedLight
from render.meshes import mesh
from scenes import Luminaire, Picture, Pose, Scene
from scenes.lights.luminaire import shining


def description(mitsuba: Any, picture: Picture) -> dict:
    """Descriptions of all lights by name; parts that are not simulated must already be neutral."""
    scene, found = picture.scene, {}
    for i, (light, pose) in enumerate(zip(scene.lights, picture.lights, strict=True)):
        if light.intensity > 0:
            made = _emitters(mitsuba, scene, light, pose)
            found.update({f"light{i}" if len(made) == 1 else f"light{i}_{k}": each for k, each in enumerate(made)})
    return found


def seen(mitsuba: Any, picture: Picture) -> dict:
    """Description of a backlight as the sensor sees it, its cone left out."""
    light, poses = picture.scene.lights[0], np.array(list(picture.lights[0]))
    pictures = Pictures.of(picture)
    part = passed(pictures, 0, analyser_axis(picture.scene, pictures.sensors))
    axes = light_frame(picture.scene.camera, light, poses)
    radiance = picture.scene.camera.exposure * light.intensity * float(np.squeeze(part))
    described = shining(light.shape(), _to_scene(axes, pictures.lights_at[0]), radiance)
    return {"light0": _made(mitsuba, described)}


def lamps(picture: Picture, active: frozenset[str]) -> tuple[PolarisedLight, ...]:
    """Where polarised lights stand, their directions of polarisation, and the angles (radians) that they span."""
    scene, found = picture.scene, []
    for i, (light, pose) in enumerate(zip(scene.lights, picture.lights, strict=True)):
        at = light_position(scene.camera, light, np.array(list(pose)))
        axis = polarisation_axis(scene, i, at) if "polarisation" in active else None
        if axis is not None:
            found.append(PolarisedLight(tuple(at.tolist()), tuple(axis.tolist()), 2 * light.half_size / light.distance))
    return tuple(found)


def _emitters(mitsuba: Any, scene: Scene, light: Luminaire, pose: Pose) -> list[Any]:
    """One light. A white Lambertian surface sends exposure / pi of what a light of intensity 1 gives it."""
    poses = np.array(list(pose))
    axes = _to_scene(light_frame(scene.camera, light, poses), light_position(scene.camera, light, poses))
    return [_made(mitsuba, each) for each in light.described(axes, math.pi * scene.camera.exposure, reach_of(scene))]


def _to_scene(axes: Frame, position: np.ndarray) -> np.ndarray:
    """From a light's axes (right, down, towards the reference point, or parallel to that from aside), (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([axes.right, axes.down, axes.forward], -1)
    matrix[:3, 3] = position
    return matrix


def _made(mitsuba: Any, described: dict[str, Any]) -> Any:
    """What Mitsuba loads of a light's own description: transforms of matrices, meshes of triangles."""
    if "triangles" in described:
        return mesh(mitsuba, described["triangles"], described["bsdf"], emitter=described["emitter"])
    if "to_world" in described:
        return {**described, "to_world": mitsuba.ScalarTransform4f(described["to_world"].tolist())}
    return described
