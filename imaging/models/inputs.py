"""Pictures with inputs that a scene is not sure of moved by their standard uncertainties."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imaging.geometry.projection import frame
from imaging.light.appearance import is_plain
from scenes import Picture, Pose, Scene
from scenes.materials import Brdf

LIMIT = math.sqrt(3.0)  # standard deviations: the end of a uniform distribution, where a shadow may reach an edge


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


def with_lights_moved(picture: Picture, times: float = 1.0) -> Iterator[Picture]:
    """The picture with each light moved by so many standard uncertainties: away, along the meridian, and across it."""
    step = times * u_of(picture.scene.uncertainty.light_place)
    for i, light in enumerate(picture.scene.lights):
        if light.faces_sensor or step == 0:
            continue
        yield picture.with_scene(_with_light(picture.scene, i, light.tried(distance=(1 + step) * light.distance)))
        for pose in _beside(picture.lights[i], step):
            yield replace(picture, lights=(*picture.lights[:i], pose, *picture.lights[i + 1 :]))


class Moved(NamedTuple):
    """A picture with one input moved by so many standard uncertainties, and the other way."""

    one: Picture
    other: Picture
    times: float
    of_surfaces: bool


def both_ways(picture: Picture) -> Iterator[Moved]:
    """The picture with each input moved: materials, the floor, and lights as far as they may stand."""
    for others, times in ((of_other_surfaces, 1.0), (with_lights_moved, LIMIT)):
        for one, other in zip(others(picture, times), others(picture, -times), strict=True):
            yield Moved(one, other, times, others is of_other_surfaces)


def u_of(told) -> float:
    return 0.0 if told is None else told.u


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
