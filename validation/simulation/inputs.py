"""Pictures with inputs that a scene is not sure of moved by their standard uncertainties; what closed form tells of
them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from imaging.features.measurand import measurands
from imaging.geometry.projection import frame
from imaging.light.appearance import is_plain
from imaging.models.bias import bias
from imaging.pictures import Pictures
from scenes import Picture, Pose, Scene
from scenes.materials import Brdf
from validation.simulation.how import How

REFLECTANCE, LIGHT = "reflectance", "light_place"


def of_other_surfaces(picture: Picture, times: float = 1.0) -> Iterator[Picture]:
    """The picture with each material, and the floor, reflecting less by its standard uncertainty.

    One material of one convex body is not among them: it changes nothing but the scale of brightness.

    Parameters
    ----------
    picture : Picture
    times : float
        Of the standard uncertainty; negative: reflecting more, be it more than all.
    """
    scene, part = picture.scene, times * u_of(picture.scene.uncertainty.reflectance)
    if part == 0 or (is_plain(scene) and not scene.materials):
        return
    dimmed = scene.material.dimmed(part)
    if dimmed is not None:
        yield picture.with_scene(scene.tried(material=dimmed))
    if scene.bright_floor is not None:
        floor = scene.bright_floor.tried(reflectance=(1 - part) * scene.bright_floor.reflectance)
        yield picture.with_scene(scene.tried(floor=floor))
    for i, each in enumerate(scene.materials):
        dimmed = each.dimmed(part) if isinstance(each, Brdf) else None
        if dimmed is not None:
            yield picture.with_scene(scene.tried(materials=(*scene.materials[:i], dimmed, *scene.materials[i + 1 :])))


def of_unknown_kinds(picture: Picture) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Infinite where a material that matters is of a kind that does not say how it reflects less."""
    scene = picture.scene
    used = (*scene.materials, *((scene.material,) if scene.materials or not is_plain(scene) else ()))
    if all(isinstance(each, Brdf) and each.dimmed(0.5) is not None for each in used):
        return {}
    unknown = np.full(len(picture.scene.quantities), np.inf)
    return {REFLECTANCE: (unknown, unknown)}


def with_lights_moved(picture: Picture, times: float = 1.0) -> Iterator[Picture]:
    """The picture with each light moved by so many standard uncertainties: away, along the meridian, and across it."""
    step = times * u_of(picture.scene.uncertainty.light_place)
    for i, light in enumerate(picture.scene.lights):
        if light.faces_sensor or step == 0:
            continue
        yield picture.with_scene(_with_light(picture.scene, i, light.tried(distance=(1 + step) * light.distance)))
        for pose in _beside(picture.lights[i], step):
            yield replace(picture, lights=(*picture.lights[:i], pose, *picture.lights[i + 1 :]))


def _with_light(scene: Scene, which: int, light) -> Scene:
    if scene.light is not None:
        return scene.tried(light=light)
    several = scene.several_lights
    return scene.tried(several_lights=(*several[:which], light, *several[which + 1 :]))


def _beside(pose: Pose, step: float) -> Iterator[Pose]:
    """Poses a step away, radians, along the meridian and across it."""
    axes = frame(np.array(list(pose)))
    for way in (axes.down, axes.right):
        x, y, z = math.sin(step) * way - math.cos(step) * axes.forward
        yield Pose(math.degrees(math.atan2(math.hypot(x, y), z)), math.degrees(math.atan2(y, x)))


def light_in_closed_form(picture: Picture, how: How) -> tuple[np.ndarray, np.ndarray] | None:
    """Standard uncertainties (M,) of the bias by lights' places, in the object and in the image.

    None where the closed form of the bias is another one's than that of what measures, or has no value.
    """
    if not (how.predicted and is_plain(picture.scene)):
        return None
    here, found = bias(Pictures.of(picture)), []
    for other in with_lights_moved(picture):
        moved = bias(Pictures.of(other))
        found.append((moved.values_object - here.values_object, moved.values - here.values))
    squares = np.square(found).sum(0) if found else np.zeros((2, len(picture.scene.quantities)))
    return tuple(np.sqrt(squares.reshape(2, -1))) if np.isfinite(squares).all() else None


def lines_by_lights(picture: Picture) -> np.ndarray:
    """What each light's place moves lines by, (k, q), in closed form; circles by nothing."""
    here, known, rows = bias(Pictures.of(picture)), measurands(Pictures.of(picture)), []
    lengths = np.linalg.norm(known.seen.along, axis=-1)
    for other in with_lights_moved(picture):
        start, stop = np.moveaxis(bias(Pictures.of(other)).lines - here.lines, -1, 0)
        rows.append(np.zeros(known.seen.count))
        rows[-1][: 2 * len(lengths)] = np.stack([start, (stop - start) / lengths], -1).ravel()
    return np.array(rows).reshape(-1, known.seen.count)


def u_of(told) -> float:
    return 0.0 if told is None else told.u
