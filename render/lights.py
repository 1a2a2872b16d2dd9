"""Lights as Mitsuba's emitters, and what the paper's reflectance has to know of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from imaging.geometry.projection import Frame, light_frame, light_position
from imaging.light.appearance import analyser_axis, polarisation_axis
from imaging.light.backlight import passed
from imaging.light.emitters import emitters, nodes, reach_of
from imaging.pictures import Pictures
from render.bsdf import Lamp
from render.meshes import mesh
from scenes import Backlight, Bar, Disc, Dome, Light, Luminaire, Picture, Pose, Ring, Scene

_SMALL = 1e-2  # of the distance: in single precision Mitsuba samples a smaller sphere wrongly, but not a disc
_AROUND, _DOWN = 128, 32  # pieces of a ring and of a dome
BLACK = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 0.0}}


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
    world = _frame(mitsuba, axes, pictures.lights_at[0]) @ _sides(mitsuba, light)
    radiance = picture.scene.camera.exposure * light.intensity * float(np.squeeze(part))
    return {"light0": _shining({"type": "rectangle", "to_world": world}, radiance)}


def lamps(picture: Picture, active: frozenset[str]) -> tuple[Lamp, ...]:
    """Where polarised lights stand, their directions of polarisation, and the angles (radians) that they span."""
    scene, found = picture.scene, []
    for i, (light, pose) in enumerate(zip(scene.lights, picture.lights, strict=True)):
        at = light_position(scene.camera, light, np.array(list(pose)))
        axis = polarisation_axis(scene, i, at) if "polarisation" in active else None
        if axis is not None:
            found.append(Lamp(tuple(at.tolist()), tuple(axis.tolist()), 2 * light.half_size / light.distance))
    return tuple(found)


def _emitters(mitsuba: Any, scene: Scene, light: Luminaire, pose: Pose) -> list[Any]:
    """One light. A white Lambertian surface sends exposure / pi of what a light of intensity 1 gives it."""
    exposure, poses = math.pi * scene.camera.exposure, np.array(list(pose))
    position, axes = light_position(scene.camera, light, poses), light_frame(scene.camera, light, poses)
    if isinstance(light, Light):
        return [_ball(mitsuba, light, axes, position, exposure * light.intensity)]
    if isinstance(light, Backlight) and light.cone_deg < 90:
        return _beams(scene, light, poses, exposure)
    made = nodes(light, reach_of(scene))
    return [_area(mitsuba, light, axes, position, exposure * made.powers.sum() / made.area)]


def _ball(mitsuba: Any, light: Light, axes: Frame, position: np.ndarray, white: float) -> dict:
    """A point, or a sphere; a disc where that is so small that Mitsuba's single precision would fail."""
    if light.radius == 0:
        value = {"type": "spectrum", "value": white * light.distance**2}
        return {"type": "point", "position": position.tolist(), "intensity": value}
    radiance = white * light.distance**2 / (math.pi * light.radius**2)
    if light.radius < _SMALL * light.distance:
        disc = {"type": "disk", "to_world": _frame(mitsuba, axes, position).scale(light.radius)}
        return _shining(disc, radiance)
    return _shining({"type": "sphere", "center": position.tolist(), "radius": light.radius}, radiance)


def _beams(scene: Scene, light: Backlight, poses: np.ndarray, exposure: float) -> list[dict]:
    """A telecentric light's directions."""
    found = []
    lone = scene.lit_by(light)
    for each in emitters(lone, (poses,)):
        away = np.array(scene.camera.look_at) - each.at
        value = {"type": "spectrum", "value": exposure * each.power / float(away @ away)}
        found.append({"type": "directional", "direction": away.tolist(), "irradiance": value})
    return found


def _area(mitsuba: Any, light: Luminaire, axes: Frame, position: np.ndarray, radiance: float):
    """A flat light, or part of a cone or a sphere, of a radiance."""
    world = _frame(mitsuba, axes, position)
    if isinstance(light, Disc):
        return _shining({"type": "disk", "to_world": world.scale(light.radius)}, radiance)
    if isinstance(light, Bar | Backlight):
        return _shining({"type": "rectangle", "to_world": world @ _sides(mitsuba, light)}, radiance)
    corners = _ring(light) if isinstance(light, Ring) else _dome(light)
    triangles = position + corners @ np.stack([axes.right, axes.down, axes.forward])
    emitter = {"type": "area", "radiance": {"type": "spectrum", "value": radiance}}
    return mesh(mitsuba, triangles, BLACK, emitter=emitter)


def _sides(mitsuba: Any, light: Bar | Backlight) -> Any:
    """From Mitsuba's square of half side 1 to the light's rectangle, its own right and down (`_frame`) for axes."""
    turned = mitsuba.ScalarTransform4f()
    if isinstance(light, Backlight):
        return turned.scale([light.half_side, light.half_side, 1.0])
    return turned.rotate([0, 0, 1], light.turn_deg).scale([light.length / 2, light.width / 2, 1.0])


def _frame(mitsuba: Any, axes: Frame, position: np.ndarray) -> Any:
    """To the scene from a light's axes: right, down, and towards the reference point (parallel to it from aside)."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([axes.right, axes.down, axes.forward], -1)
    matrix[:3, 3] = position
    return mitsuba.ScalarTransform4f(matrix.tolist())


def _shining(shape: dict, radiance: float) -> dict:
    emitter = {"type": "area", "radiance": {"type": "spectrum", "value": radiance}}
    return {**shape, "bsdf": BLACK, "emitter": emitter}


def _ring(light: Ring) -> np.ndarray:
    """Triangles in the light's axes, (T, 3, 3), their outside towards the object."""
    radii = np.array([light.inner_radius, light.outer_radius])
    return _turned(radii, (radii - radii.mean()) * np.tan(np.radians(light.tilt_deg)), 1)


def _dome(light: Dome) -> np.ndarray:
    angles = np.radians(np.linspace(light.opening_deg, light.half_angle_deg, _DOWN + 1))
    return _turned(light.distance * np.sin(angles), light.distance * (1 - np.cos(angles)), _DOWN)


def _turned(radii: np.ndarray, heights: np.ndarray, pieces: int) -> np.ndarray:
    """The surface that a line of radii and heights makes turning about the axis, as flat pieces of the same area."""
    step = 2 * np.pi / _AROUND
    angle = np.arange(_AROUND + 1) * step
    circle = np.stack([np.cos(angle), np.sin(angle)], -1) * np.sqrt(step / np.sin(step))
    places = np.concatenate(
        [radii[:, None, None] * circle, np.broadcast_to(heights[:, None, None], (pieces + 1, angle.size, 1))], -1
    )
    a, b, c, d = places[:-1, :-1], places[1:, :-1], places[1:, 1:], places[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], -2).reshape(-1, 3, 3), np.stack([a, c, d], -2).reshape(-1, 3, 3)])
