"""The piece of work that a run consists of: a plain function of its argument, run by any executor."""

from __future__ import annotations

import functools
import math
import threading
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from threadpoolctl import ThreadpoolController

import measure
import planner
import render
from measure import Correction
from render import EffectTolerance, Quality
from render import variant as variants
from scenes import InvalidInput, Jitter, Scene
from scenes.cameras.pinhole import MOST_PIXELS
from validation import simulation
from validation.batch import measurands, photographs
from validation.batch.campaign import Case
from validation.remeasured import MeasuredValues, Method, batches, remeasured

CHUNK = 250  # images; a run's random numbers depend on it
_BATCH = 50  # images held in memory at a time, and fewer of more than ...
_MOST_PIXELS = 1 << 25  # ... pixels, 256 MiB
Shots = Callable[[np.random.Generator, int], np.ndarray]  # stacks of pictures
_RENDERER = threading.Lock()  # a Dask worker may have several threads, and Mitsuba loads and renders in one


def methods(scene: Scene) -> tuple[Method, ...]:
    """All methods that a run compares; the first is the one its verdict is about.

    Raises
    ------
    InvalidInput
        If a name is no estimator's or comes twice, or ``canny`` is alone and has no threshold.
    """
    names = scene.locator.estimators
    for i, name in enumerate(names):
        if name in names[:i] or name not in measure.ESTIMATORS:
            known = ", ".join(measure.ESTIMATORS)
            raise InvalidInput(f"locator.estimators must be different ones of {known}, got {', '.join(names)}")
    found = [_methods(name, scene.locator.thresholds) for name in names]
    if not any(found):
        raise InvalidInput("locator.thresholds must be given where canny is the only estimator, got none")
    return tuple(method for some in found for method in some)


def _methods(name: str, thresholds: tuple[float, ...]) -> list[Method]:
    return [Method(name, threshold) for threshold in thresholds] if name == "canny" else [Method(name)]


class Packed(NamedTuple):
    """A noise-free image as it travels and is stored: zlib-compressed little-endian float64."""

    height: int
    width: int
    data: bytes

    @classmethod
    def of(cls, image: np.ndarray) -> Packed:
        return cls(*image.shape, zlib.compress(image.astype("<f8").tobytes(), 1))

    def fits(self) -> bool:
        """Whether the size is one that a camera has."""
        size = self.height, self.width
        return all(isinstance(n, int) and n > 0 for n in size) and math.prod(size) <= MOST_PIXELS

    def array(self) -> np.ndarray:
        """The image, float64, shape (height, width).

        Raises
        ------
        ValueError, zlib.error
            If the data are not such an image; no more of them is unpacked than fits it.
        """
        size = 8 * self.height * self.width
        data = zlib.decompressobj().decompress(self.data, size + 1)
        return np.frombuffer(data, "<f8").reshape(self.height, self.width)


@dataclass(frozen=True)
class Clean:
    """The noise-free image of a setting and what is predicted, with and without it.

    Attributes
    ----------
    image : Packed
    propagated : dict
        Variance (px^2), value of the first measurand in the image (px, or degrees) and status, by method; and of each
        measurand in the scene's unit, by `measurands.column`.
    predicted : dict
        Variances that need no image, px^2 (``paper`` without its free scale), the model's ``value_px`` and the classic
        locators' ``predicted_bias``, px, of the first measurand; those of all in the scene's unit as ``measurands``.
    """

    image: Packed
    propagated: dict[str, tuple[float, float, str]]
    predicted: dict[str, Any]
    seconds: dict[str, float]


@dataclass(frozen=True, eq=False)
class Chunk:
    """Values of one chunk of images; statuses of the images that failed.

    One array a method, of the first measurand in the image (px, or degrees), and of the verdict's method one more for
    each measurand (`measurands.column`), in the scene's unit.
    """

    distances: dict[str, np.ndarray]
    failures: dict[str, dict[int, str]]
    seconds: dict[str, float]


@dataclass(frozen=True)
class Rendering:
    """How noise-free images are made: rays, which effects, and what ``auto`` may leave out."""

    quality: Quality = Quality()
    effects: str = "auto"
    tolerance: EffectTolerance = EffectTolerance()


@dataclass(frozen=True)
class Chunks:
    """Chunks of one setting, (number, images) each; without an image the worker renders it.

    With ``photos``, all files of the setting, nothing is rendered: they are measured, and the image is their mean.
    """

    case: Case
    chunks: tuple[tuple[int, int], ...]
    seed: int
    variant: str
    image: Packed | None = None
    rendering: Rendering = Rendering()
    photos: tuple[str, ...] = ()


@dataclass(frozen=True)
class TaskResult:
    """What a task found; ``trouble`` says in one line why the setting cannot be worked on."""

    clean: Clean | None
    chunks: dict[int, Chunk]
    trouble: str | None = None


def perform(task: Chunks) -> TaskResult:
    """Render, unless the image came with the task, then measure.

    With one thread of linear algebra, whatever the worker's environment says: a sum split over threads has other bits.
    """
    with _libraries().limit(limits=1):
        return _perform(task)


def perform_all(tasks: tuple[Chunks, ...]) -> tuple[TaskResult, ...]:
    """Several pieces of work as one, where a scheduler could not keep count of each."""
    return tuple(map(perform, tasks))


@functools.cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def _perform(task: Chunks) -> TaskResult:
    if not task.photos:
        with _RENDERER:
            variants.use(task.variant)  # what the machine cannot do is not the setting's fault
    try:
        clean = None
        if task.image is None:
            mean = photographs.mean(task.case.scene, task.photos) if task.photos else None
            with _RENDERER:
                clean = render_setting(task.case, task.variant, task.rendering, mean)
        image = (task.image or clean.image).array()
        return TaskResult(
            clean, {k: measure_chunk(task.case, image, task.seed, k, n, _shots(task, k)) for k, n in task.chunks}
        )
    except InvalidInput as error:
        return TaskResult(None, {}, str(error))


def _shots(task: Chunks, chunk: int) -> Shots | None:
    """Takes a chunk's photographs, or pictures from poses set anew each time; None where that does not matter."""
    if task.photos:
        return photographs.exposures(task.case.scene, task.photos[chunk * CHUNK :])
    scene, setting, how = task.case.scene, task.case.setting, task.rendering
    if _jitter(task.case, how) == Jitter():
        return None

    def take(rng: np.random.Generator, count: int) -> np.ndarray:
        with _RENDERER:
            return render.shots(scene, setting.sensor, setting.light, rng, count, variant=task.variant, **vars(how))

    return take


def _jitter(case: Case, how: Rendering) -> Jitter:
    """How exactly poses are set, as far as it is simulated."""
    scene = case.scene
    if scene.jitter == Jitter():  # nearly always: spare the choice
        return scene.jitter
    return render.choose(scene, how.effects, how.tolerance, case.picture).scene.jitter


def render_setting(case: Case, variant: str, how: Rendering = Rendering(), image: np.ndarray | None = None) -> Clean:
    """Render a setting, unless its image is given, and predict with and without it."""
    clock = _Clock()
    scene, picture = case.scene, case.picture
    predicted = {model: planner.predict(picture, model=model) for model in ("paper", "calibrated", "bound")}
    numbers = {model: found.variance_image for model, found in predicted.items()}
    biased = "calibrated" if measure.ESTIMATORS[methods(scene)[0].locator].bias_predicted else "bound"
    numbers |= {"value_px": predicted["calibrated"].value_image, "predicted_bias": predicted[biased].bias_image}
    numbers |= measurands.texture(predicted["calibrated"].measurands[0].texture_variance_image)
    numbers["measurands"] = measurands.predicted(predicted, biased)
    clock.lap("predict")
    renders = None
    used = methods(scene)
    way = simulation.How(how.quality, variant, how.effects, how.tolerance).by(*used, of=scene)
    photographed = image is not None
    if not photographed:
        image = render.image(picture, variant=variant, **vars(how))
        renders = simulation.steadied(picture, image, used[0], way)
        image = renders.mean(picture)
        clock.lap("render")
    shaken = scene.model_copy(update={"jitter": _jitter(case, how)})
    spread = planner.pose_scatter(shaken, np.array([list(picture.sensor)]))
    found = [
        measure.propagate(image, picture, estimator=m.locator, threshold=m.threshold, photographed=photographed)
        for m in used
    ]
    clock.lap("propagate")
    off: tuple[Correction, ...] = ()
    if renders is not None:
        off = simulation.independent(picture, used, renders, tuple(each.measurands for each in found), way)
        _note_corrections(numbers, used, off)
        clock.lap("correct")
    return Clean(Packed.of(image), _propagated(used, found, off, spread), numbers, clock.seconds)


def _note_corrections(numbers: dict[str, Any], used: tuple[Method, ...], off: tuple[Correction, ...]) -> None:
    """Beside what is predicted: the biases that are taken off, of the first measurand by method, px, and of all."""
    numbers["corrections"] = {
        method.name: measurands.correction(each.bias_image[0], each.u_bias_image[0], each.beside_image[0])
        for method, each in zip(used, off, strict=True)
    }
    for m, told in enumerate(numbers["measurands"]):
        told["correction"] = measurands.correction(off[0].bias[m], off[0].u_bias[m], off[0].beside[m])


def _propagated(
    used: tuple[Method, ...], found: list[measure.Propagated], off: tuple[Correction, ...], spread: Any
) -> dict[str, tuple[float, float, str]]:
    """Variance with the poses' scatter, value and status, as of `Clean`; statuses are what the correction leaves."""
    told = {}
    for i, (method, each) in enumerate(zip(used, found, strict=True)):
        states = off[i].status if off else each.measurands.status
        told[method.name] = each.variance_px2 + float(spread.covariance[0, 0, 0]), each.value_px, states[0]
        if i == 0:
            in_object = np.diag(spread.covariance_object[0])
            told |= measurands.propagated(method.name, each.measurands, in_object, states)
    return told


def measure_chunk(
    case: Case, image: np.ndarray, seed: int, chunk: int, count: int, shots: Shots | None = None
) -> Chunk:
    """Expose ``count`` images of a setting and measure each with every method.

    ``shots`` takes the pictures where exposing the one noise-free image is not enough.

    The random numbers depend on seed, setting, chunk and batch alone, so a run gives the same numbers in any order and
    with any number of workers, and a longer run begins with the shorter one's.
    """
    cv2.setNumThreads(1)  # workers share the cores among themselves
    clock, picture = _Clock(), case.picture
    where = measure.region_of_interest(picture)
    clock.lap("prepare")
    take = shots or functools.partial(render.Exposer(image, case.scene.noise, where).take, again=True)
    counts = batches(count, batch_size(image))
    exposures = (take(_stream(seed, case.index, chunk, batch), many) for batch, many in enumerate(counts))
    found = remeasured(picture, exposures, methods(case.scene), clock.lap)
    values, statuses = _columns(case.scene, found)
    return Chunk(values, {name: _failures(values[name], statuses[name]) for name in values}, clock.seconds)


def batch_size(image: np.ndarray) -> int:
    """How many images of a size are exposed and measured at a time."""
    return max(1, min(_BATCH, _MOST_PIXELS // image.size))


def _stream(*place: int) -> np.random.Generator:
    """The random numbers of a batch: of seed, setting, chunk, and batch."""
    seed, *key = place
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=tuple(key)))


def _columns(scene: Scene, found: tuple[MeasuredValues, ...]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Values and statuses as of a `Chunk`, by name."""
    names = [method.name for method in methods(scene)]
    values = {name: each.image[:, 0] for name, each in zip(names, found, strict=True)}
    statuses = {name: each.status[:, 0] for name, each in zip(names, found, strict=True)}
    for k in range(len(scene.quantities)):
        name = measurands.column(names[0], k)
        values[name], statuses[name] = found[0].object[:, k], found[0].status[:, k]
    return values, statuses


def _failures(values: np.ndarray, statuses: np.ndarray) -> dict[int, str]:
    """Status by image of those that gave no value."""
    return {int(i): str(statuses[i]) for i in np.flatnonzero(np.isnan(values))}


def effects(scene: Scene, how: Rendering = Rendering()) -> list[dict[str, Any]]:
    """Which effects the renderer simulates for a scene's settings, and why."""
    found = render.effects(scene, how.tolerance, how.effects)
    return [{"effect": each.effect.name, "on": each.on, "reason": each.reason} for each in found]


class _Clock:
    """Adds up wall time by what it was spent on."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._last = now
