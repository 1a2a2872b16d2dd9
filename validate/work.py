"""The two pieces of work that a run consists of. Both are plain functions of their arguments, run by any executor."""

from __future__ import annotations

import time
from dataclasses import dataclass

import cv2
import numpy as np

import measure
import planner
import render
from scenes import Scene

CHUNK = 250  # images; a run's random numbers depend on it
_BATCH = 50  # images held in memory at a time


@dataclass(frozen=True)
class Method:
    """A locator, with its gradient threshold if it has one."""

    locator: str
    threshold: float | None = None

    @property
    def name(self) -> str:
        """Name in tables and in the run file: "gradient", "canny@12"."""
        return self.locator if self.threshold is None else f"{self.locator}@{self.threshold:g}"


def methods(scene: Scene) -> tuple[Method, ...]:
    """All methods that a run compares; the first is the one its verdict is about."""
    return (Method("gradient"), *(Method("canny", threshold) for threshold in scene.locator.thresholds))


@dataclass(frozen=True)
class Clean:
    """The noise-free image of a setting and what is predicted from it, one `measure.Propagated` summary a method."""

    image: np.ndarray
    propagated: dict[str, tuple[float, float, str]]  # variance px^2, value px, status
    seconds: dict[str, float]


@dataclass(frozen=True)
class Chunk:
    """Distances of one chunk of images, one array a method; statuses of the images that failed."""

    distances: dict[str, np.ndarray]
    failures: dict[str, dict[int, str]]
    seconds: dict[str, float]


def render_setting(scene: Scene, setting: int, variant: str) -> Clean:
    """Render a setting and predict from its image."""
    clock = _Clock()
    sensor, light = scene.settings[setting].sensor, scene.settings[setting].light
    image = render.image(scene, sensor, light, variant=variant)
    clock.lap("render")
    propagated = {}
    for method in methods(scene):
        found = measure.propagate(image, scene, sensor, light, method.locator, method.threshold)
        propagated[method.name] = found.variance_px2, found.value_px, found.status
    clock.lap("propagate")
    return Clean(image, propagated, clock.seconds)


def measure_chunk(scene: Scene, setting: int, image: np.ndarray, seed: int, chunk: int, count: int) -> Chunk:
    """Expose ``count`` images of a setting and measure each with every method.

    The random numbers depend on seed, setting, chunk and batch alone, so a run gives the same numbers in any order and
    with any number of workers, and a longer run begins with the shorter one's.
    """
    cv2.setNumThreads(1)  # workers share the cores among themselves
    clock = _Clock()
    sensor = scene.settings[setting].sensor
    where = measure.footprint(scene, sensor)
    clock.lap("prepare")
    parts: dict[str, list[measure.Measurement]] = {method.name: [] for method in methods(scene)}
    for batch, first in enumerate(range(0, count, _BATCH)):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(setting, chunk, batch)))
        pictures = render.expose(image, scene.noise, rng, min(_BATCH, count - first), where)
        clock.lap("expose")
        for method in methods(scene):
            found = measure.distance(pictures, scene, sensor, None, method.locator, method.threshold)
            parts[method.name].append(found)
            clock.lap(method.name)
    distances = {name: np.concatenate([part.value_px for part in found]) for name, found in parts.items()}
    statuses = {name: np.concatenate([part.status for part in found]) for name, found in parts.items()}
    failures = {
        name: {int(i): str(statuses[name][i]) for i in np.flatnonzero(np.isnan(values))}
        for name, values in distances.items()
    }
    return Chunk(distances, failures, clock.seconds)


def predictions(scene: Scene, setting: int) -> dict[str, float]:
    """The prices that need no image, px^2; ``paper`` without its free scale."""
    sensor, light = scene.settings[setting].sensor, scene.settings[setting].light
    return {
        price: planner.predict(scene, sensor, light, price).variance_px2 for price in ("paper", "calibrated", "bound")
    }


class _Clock:
    """Adds up wall time by what it was spent on."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._last = now
