"""The renderer where its single precision, or its frame, could fail: references are closed forms of the projection."""

from __future__ import annotations

from functools import partial

import numpy as np

import measure
import render
from imaging.geometry.projection import project
from render.quality import Quality
from scenes import InvalidInput, Scene
from validation.hard.case import Answer, Case, Reference
from validation.hard.scenes_for import scaled, task1

_SMALL = {"width": 128, "height": 120, "focal_px": 400.0}
_QUICK = Quality(supersample=3, samples=4)
_BIAS = 0.05  # px; of the gradient locator on a small image of few rays
_LEVEL = 2e-3  # relative, of a level averaged over a few pixels


def cases() -> list[Case]:
    """A few images; a scalar variant takes a second for each."""
    found = []
    for factor in (1e-6, 1.0, 1e3, 1e6):
        found.append(_distance(f"all lengths x {factor:g}", _small(scaled(factor)), (30, 135)))
    found.append(_distance("sensor at the north pole", _small(task1()), (0, 0)))
    found.append(_level("light at 85 deg", _small(task1()), (85, 315)))
    found.append(_level("light 0.01 deg over the top's plane", _small(task1()), (88.5575, 315)))
    far = task1(camera={"distance": 1e6, "focal_px": 8e6}, light={"distance": 1e6})
    truth = Reference(None, "rule")
    found.append(Case("render", "focal length of 8 million px", "image", partial(_refused, far), lambda: truth))
    return found


def _small(scene: Scene) -> Scene:
    camera = {**scene.camera.model_dump(), **_SMALL}
    return scene.model_copy(update={"camera": type(scene.camera).model_validate(camera)})


def _distance(name: str, scene: Scene, sensor) -> Case:
    """The distance measured in the render, against the projection."""
    vertices = np.array([scene.solid.vertex(corner.vertex) for corner in scene.task.corners])
    images = project(vertices, np.array(sensor, float), scene.camera)
    truth = Reference(float(np.linalg.norm(images[1] - images[0])), "closed form", None, _BIAS, scale=1.0)

    def ours() -> Answer:
        found = measure.distance(render.image(scene, sensor, (15, 315), _QUICK), scene, sensor)
        good = np.isfinite(found.value_px)
        return Answer(float(found.value_px) if good else None, str(found.status))

    return Case("render", name, "distance px", ours, lambda: truth)


def _level(name: str, scene: Scene, light) -> Case:
    """Grey level in the middle of the top face, against cosine over squared distance, from above."""
    middle = scene.solid.vertices[list(scene.solid.faces[0])].mean(0)
    away = scene.lights[0].distance * np.array(
        [np.sin(np.radians(light[0])) * np.cos(np.radians(light[1])),
         np.sin(np.radians(light[0])) * np.sin(np.radians(light[1])), np.cos(np.radians(light[0]))]
    ) - middle  # fmt: skip
    size = np.linalg.norm(away)
    white = scene.camera.exposure * scene.material.lambertian
    exact = white * away[2] / size * (scene.lights[0].distance / size) ** 2
    x, y = np.rint(project(middle[None], np.array([0.0, 0.0]), scene.camera)[0]).astype(int)

    def ours() -> Answer:
        image = render.image(scene, (0, 0), light, _QUICK) - scene.noise.dark_level
        return Answer(float(image[y - 1 : y + 2, x - 1 : x + 2].mean()))

    return Case("render", name, "grey level", ours, lambda: Reference(float(exact), "closed form", None, _LEVEL))


def _refused(scene: Scene) -> Answer:
    try:
        return Answer(float(render.image(scene, (30, 135), (15, 315)).mean()))
    except InvalidInput as error:
        return Answer(None, str(error))
