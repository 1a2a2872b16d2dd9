"""Mitsuba's description of a scene: only the parts that the chosen effects call for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner.imaging.projection import direction, frame
from render import bsdf
from render.meshes import mesh
from render.rays import SURFACES
from render.reflectance import indices
from scenes import Floor, Pose, Scene

_TINY_APERTURE = 1e-4  # of the distance: Mitsuba accepts it, and it changes nothing
_SMALL_LIGHT = 1e-2  # of the distance: in single precision Mitsuba samples a smaller sphere wrongly, but not a disc
CUSTOM = {"specular_lobe", "polarisation", "analyser", "wavelength"}


def description(
    mitsuba: Any,
    scene: Scene,
    sensor: Pose,
    light: Pose,
    active: frozenset[str],
    size: tuple[int, int],
    crop: tuple[slice, slice],
    samples: int,
) -> dict:
    """Description of a scene with the named effects.

    Parameters
    ----------
    active : frozenset of str
        Names of effects; a scene's part whose effect is not named must already be neutral.
    size : tuple of int
        Fine pixels of the whole frame, (width, height).
    crop : tuple of slice
        Rows and columns of fine pixels to render.
    samples : int
        Rays a fine pixel.
    """
    integrator = {"type": "path", "max_depth": SURFACES + 1, "rr_depth": 99} if "interreflection" in active else {}
    surface = _surface(mitsuba, scene, sensor, light, active)
    parts = {
        "type": "scene",
        "integrator": {"type": "direct", "hide_emitters": True, **integrator},
        "sensor": view(mitsuba, scene, sensor, active, size, crop, samples),
        "light": _light(mitsuba, scene, light, active),
        "object": mesh(mitsuba, scene.solid, surface),
    }
    for i, obstacle in enumerate(scene.obstacles if "cast_shadow" in active else ()):
        parts[f"obstacle{i}"] = mesh(mitsuba, obstacle.solid, surface)
    if "floor" in active:
        parts["floor"] = _floor(mitsuba, scene.floor or Floor(reflectance=0.0, height=_lowest(scene)))
    return parts


def light_radius(scene: Scene, active: frozenset[str]) -> float:
    """Radius of the light as it is simulated, cm."""
    return scene.light.radius if "light_size" in active else 0.0


def aperture_radius(scene: Scene, active: frozenset[str]) -> float:
    """Radius of the aperture as it is simulated, cm."""
    least = _TINY_APERTURE * scene.camera.distance
    return max(scene.camera.lens.aperture_radius, least) if "depth_of_field" in active else 0.0


def polariser_axes(scene: Scene, sensor: Pose, light: Pose) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Directions in space of the light's polarisation and of the analyser; None without them."""
    found = []
    for angle, pose, names in (
        (scene.light.polarisation_deg, light, ("down", "right")),
        (scene.camera.analyser_deg, sensor, ("right", "down")),
    ):
        axes = frame(np.array(list(pose)))
        first, second = (getattr(axes, name) for name in names)
        turn = None if angle is None else math.radians(angle)
        found.append(None if turn is None else math.cos(turn) * first + math.sin(turn) * second)
    return found[0], found[1]


def _surface(mitsuba, scene: Scene, sensor: Pose, light: Pose, active: frozenset[str]) -> dict:
    material = scene.material
    if not active & CUSTOM:
        albedo = (1 - material.specular_fraction) * material.diffuse_reflectance
        return {"type": "diffuse", "reflectance": {"type": "spectrum", "value": albedo}}
    polarisation, analyser = (
        None if axis is None else tuple(axis.tolist()) for axis in polariser_axes(scene, sensor, light)
    )
    places = [tuple(scene.position(role, pose).tolist()) for role, pose in (("sensor", sensor), ("light", light))]
    return bsdf.describe(
        mitsuba,
        bsdf.Surface(
            material,
            indices(scene, spectral="wavelength" in active),
            *places,
            polarisation=polarisation if "polarisation" in active else None,
            analyser=analyser if "analyser" in active else None,
            light_angle=2 * light_radius(scene, active) / scene.light.distance,
            sensor_angle=2 * aperture_radius(scene, active) / scene.camera.distance,
        ),
    )


def view(mitsuba, scene: Scene, sensor: Pose, active, size, crop, samples: int) -> dict:
    """Description of the sensor, for a crop of the whole frame of fine pixels."""
    camera, axes = scene.camera, frame(np.array(list(sensor)))
    position = scene.position("sensor", sensor)
    rows, columns = crop
    lens = {"type": "perspective"}
    if "depth_of_field" in active:
        lens = {
            "type": "thinlens",
            "aperture_radius": aperture_radius(scene, active),
            "focus_distance": camera.lens.focus or camera.distance,
        }
    return {
        **lens,
        "fov_axis": "x",
        "fov": 2 * math.degrees(math.atan(camera.width / 2 / camera.focal_px)),
        "near_clip": 1e-3 * camera.distance,
        "far_clip": 1e3 * camera.distance,
        "to_world": mitsuba.ScalarTransform4f().look_at(
            origin=position.tolist(), target=[0, 0, 0], up=(-axes.down).tolist()
        ),  # single precision: a target beside the sensor would turn the image by 0.001 px
        "film": {
            "type": "hdrfilm",
            "width": size[0],
            "height": size[1],
            "crop_offset_x": columns.start,
            "crop_offset_y": rows.start,
            "crop_width": columns.stop - columns.start,
            "crop_height": rows.stop - rows.start,
            "rfilter": {"type": "box"},
            "pixel_format": "luminance",
            "component_format": "float32",
        },
        "sampler": {"type": "stratified", "sample_count": samples},
    }


def _light(mitsuba, scene: Scene, light: Pose, active) -> dict:
    """Intensity that gives a white Lambertian surface at the origin, facing the light, the camera's exposure.

    Such a surface sends albedo / pi of its irradiance, which is intensity / distance^2.
    """
    position = (scene.light.distance * direction(np.array(list(light)))).tolist()
    intensity, radius = math.pi * scene.camera.exposure * scene.light.distance**2, light_radius(scene, active)
    if radius == 0:
        value = {"type": "spectrum", "value": intensity}
        return {"type": "point", "position": position, "intensity": value}
    radiance = {"type": "spectrum", "value": intensity / (math.pi * radius**2)}
    shape = {"type": "sphere", "center": position, "radius": radius}
    if radius < _SMALL_LIGHT * scene.light.distance:
        transform, up = mitsuba.ScalarTransform4f(), frame(np.array(list(light))).right.tolist()
        shape = {
            "type": "disk",
            "to_world": transform.look_at(origin=position, target=[0, 0, 0], up=up).scale(radius),
        }
    return {
        **shape,
        "bsdf": {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 0.0}},
        "emitter": {"type": "area", "radiance": radiance},
    }


def _floor(mitsuba, floor: Floor) -> dict:
    transform = mitsuba.ScalarTransform4f()
    return {
        "type": "rectangle",
        "to_world": transform.translate([0, 0, floor.height]).scale(floor.half_side),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "spectrum", "value": floor.reflectance}},
    }


def _lowest(scene: Scene) -> float:
    return float(scene.solid.vertices[:, 2].min())
