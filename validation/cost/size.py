"""Image size: a larger sensor with the same field of view, so the object covers more pixels."""

from __future__ import annotations

import time

import numpy as np

import measure
import render
from scenes import InvalidInput, Scene
from validation.batch import work
from validation.batch.campaign import Case
from validation.cost.parameter import Parameter, Trend, slope
from validation.cost.watch import Watch

_FACTORS = (0.5, 1.0, 2.0, 4.0)
_IMAGES = 50
_LARGEST = 6_000_000  # pixels


def size_parameter(case: Case, variant: str, seed: int, watch: Watch = Watch()) -> Parameter:
    """Seconds of a render and of a noisy image, and relative error of the distance, against the image's size.

    Raises
    ------
    InvalidInput
        If the image is so large that it cannot be made larger.
    """
    rows, usable = [], [f for f in _FACTORS if f**2 * case.scene.camera.width * case.scene.camera.height <= _LARGEST]
    if len(usable) < 3:
        raise InvalidInput(f"size must be of an image below {_LARGEST / 4 / 1e6:.1f} megapixels, got a larger one")
    for number in watch.samples(len(usable), least=3):
        scene = _scaled(case.scene, usable[number])
        rendered, seconds, relative = _tried(Case(case.index, scene, case.setting), variant, seed)
        if not rows and 4 * (rendered + seconds * _IMAGES) > watch.left:  # of the next alone
            raise InvalidInput(f"size must leave time for a larger image, got {rendered:.0f} s for the smallest")
        rows.append((scene.camera.width, scene.camera.height, rendered, 1e3 * seconds, relative))
    width, height, rendered, image, error = np.array(rows).T
    fits = (
        Trend("render against pixels", slope((width * height)[1:], rendered[1:]), 1.0),
        Trend("noisy image against pixels", slope((width * height)[1:], image[1:]), 0.5),
        Trend("relative error against width", slope(width[1:], error[1:]), -1.5),
    )
    return Parameter(
        name="size",
        title="Image size: time, and error of the distance over the distance",
        columns=("width", "height", "render s", "ms an image", "relative error"),
        rows=tuple(rows),
        x="width",
        y="relative error",
        fits=fits,
        note="Theory: rendering goes with the pixels where all get equal rays; here those at an edge get most, whose "
        "number goes with the root of the pixels, so the slope lies between 1/2 and 1. Noise is drawn only beside the "
        "edges (1/2), but every image is copied whole (1). An edge has points in proportion to its length, hence -3/2 "
        "for the relative error; trimmed ends weigh more in small images.",
    )


def _tried(case: Case, variant: str, seed: int) -> tuple[float, float, float]:
    """Seconds of a render and of a noisy image, and relative error of the distance."""
    began = time.perf_counter()
    image = render.image(case.scene, case.setting.sensor, case.setting.light, variant=variant)
    rendered = time.perf_counter() - began
    found = measure.propagate(image, case.scene, case.setting.sensor)
    work.measure_chunk(case, image, seed, 0, 2)
    began = time.perf_counter()
    work.measure_chunk(case, image, seed, 0, _IMAGES)
    seconds = (time.perf_counter() - began) / _IMAGES
    return rendered, seconds, float(np.sqrt(found.variance_px2)) / found.value_px


def _scaled(scene: Scene, factor: float) -> Scene:
    camera = scene.camera
    update = {
        "width": round(factor * camera.width),
        "height": round(factor * camera.height),
        "focal_px": factor * camera.focal_px,
    }
    return scene.model_copy(update={"camera": camera.model_copy(update=update), "settings": ()})
