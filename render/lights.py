"""Lights as Mitsuba's emitters, and what the paper's reflectance has to know of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner.imaging.appearance import polarisation_axis
from planner.imaging.projection import frame, light_position
from render.bsdf import Lamp
from scenes import Light, Picture, Pose, Scene

_SMALL = 1e-2  # of the distance: in single precision Mitsuba samples a smaller sphere wrongly, but not a disc


def description(mitsuba: Any, picture: Picture, active: frozenset[str]) -> dict:
    """Descriptions of all lights by name."""
    lit = zip(picture.scene.lights, picture.lights, strict=True)
    return {f"light{i}": _emitter(mitsuba, picture.scene, light, pose, active) for i, (light, pose) in enumerate(lit)}


def lamps(picture: Picture, active: frozenset[str]) -> tuple[Lamp, ...]:
    """Where polarised lights stand, their directions of polarisation, and the angles (radians) that they span."""
    scene, found = picture.scene, []
    for i, (light, pose) in enumerate(zip(scene.lights, picture.lights, strict=True)):
        at = light_position(scene.camera, light, np.array(list(pose)))
        axis = polarisation_axis(scene, i, at) if "polarisation" in active else None
        if axis is not None:
            found.append(Lamp(tuple(at.tolist()), tuple(axis.tolist()), 2 * _radius(light, active) / light.distance))
    return tuple(found)


def _radius(light: Light, active: frozenset[str]) -> float:
    """Radius of a light as it is simulated, cm."""
    return light.radius if "light_size" in active else 0.0


def _emitter(mitsuba: Any, scene: Scene, light: Light, pose: Pose, active: frozenset[str]) -> dict:
    """Intensity that gives a white Lambertian surface at the reference point, facing the light, the camera's exposure.

    Such a surface sends albedo / pi of its irradiance, which is intensity / distance^2.
    """
    position = light_position(scene.camera, light, np.array(list(pose))).tolist()
    intensity, radius = math.pi * scene.camera.exposure * light.distance**2, _radius(light, active)
    if radius == 0:
        value = {"type": "spectrum", "value": intensity}
        return {"type": "point", "position": position, "intensity": value}
    radiance = {"type": "spectrum", "value": intensity / (math.pi * radius**2)}
    shape = {"type": "sphere", "center": position, "radius": radius}
    if radius < _SMALL * light.distance:
        transform, up = mitsuba.ScalarTransform4f(), frame(np.array(list(pose))).right.tolist()
        target = list(scene.camera.look_at)
        shape = {"type": "disk", "to_world": transform.look_at(origin=position, target=target, up=up).scale(radius)}
    return {
        **shape,
        "bsdf": {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 0.0}},
        "emitter": {"type": "area", "radiance": radiance},
    }
