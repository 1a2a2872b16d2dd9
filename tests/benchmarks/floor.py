"""How far exposing and measuring is from its floor: ``python -m tests.benchmarks.floor [SCENE ...]``.

The floor of an image: normals for the pixels that the estimator reads, made into whole grey levels, and one weighted
sum of them for each value. Beside it what `ice validate` does with an image, `render.Exposer` and `exposures_by`;
a picture's preparation is paid before. Both in turn, by the processor's time; no test, for times are machines'.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import measure
import render
import scenes
from imaging import sensor
from measure.measurands import exposures_by
from scenes import Picture
from validation.batch.work import batch_size

SCENES = "task1", "bracket_mm", "plate", "shaft"
_TURNS = 5
_ASKED = 2.5


@dataclass(frozen=True)
class Cost:
    """Of a picture: values, pixels that are read, milliseconds an image (medians of turns)."""

    name: str
    values: int
    pixels: int
    floor_ms: float
    expose_ms: float
    measure_ms: float

    @property
    def ratio(self) -> float:
        """Both over the floor."""
        return (self.expose_ms + self.measure_ms) / self.floor_ms

    def __str__(self) -> str:
        return (
            f"{self.name:<12}{self.values:3d} values {self.pixels:8,} pixels   floor {self.floor_ms:7.3f} ms   expose "
            f"{self.expose_ms:7.3f}   measure {self.measure_ms:7.3f}   {self.ratio:5.1f} times ({_ASKED} asked)"
        )


def cost(name: str) -> Cost:
    """Of a scene's first setting by the default estimator of validation."""
    scene = scenes.load(name)
    there = scene.settings[0]
    picture = Picture.of(scene, there.sensor, there.light)
    image, where = render.image(picture), measure.region_of_interest(picture)
    levels, count, many = image[where], len(scene.quantities), batch_size(image)
    spread = np.sqrt(sensor.recorded(scene.noise, levels).noise_variance)
    weights = np.random.default_rng(0).normal(size=(levels.size, count))
    full = sensor.full_scale(scene.noise)
    rng = np.random.default_rng(1)

    def floor() -> None:
        for _ in range(many):
            drawn = rng.standard_normal(levels.size)
            drawn *= spread
            drawn += levels
            np.clip(np.rint(drawn, out=drawn), 0, full, out=drawn) @ weights

    exposer = render.Exposer(image, scene.noise, where)

    def exposed() -> np.ndarray:
        return exposer.take(rng, many, again=True)

    images = exposed()

    def measured() -> None:
        exposures_by(images, picture, (("gradient", None),))

    measured()
    times = np.array([[_milliseconds(each) for each in (floor, exposed, measured)] for _ in range(_TURNS)])
    return Cost(name, count, levels.size, *map(float, np.median(times, 0) / many))


def _milliseconds(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return 1e3 * (time.process_time() - begun)


if __name__ == "__main__":
    for each in sys.argv[1:] or SCENES:
        print(cost(each), flush=True)
