"""Negative controls: something of the scene is planted wrong, and the verdict has to find it, by the right test.

Of one setting of a run the noise-free picture is exposed anew and measured as the run does. First as the scene says:
that has to agree. Then with more noise, less light or more blur than the scene says, and believed by a scene whose
camera is wrong. What is planted is as large as so many exposures have to find, `_SURE` standard errors beyond what the
verdict allows: less would be missed now and then, more would show nothing. The predictions stay those of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

import measure
import render
from scenes import Noise, Picture, Pose
from scenes.numbers import number_at, with_number
from scenes.status import is_trusted
from validation import statistics
from validation.batch.rows import Row
from validation.remeasured import Method, Sample, batches, remeasured
from validation.statistics import Verdict

_SURE = 7.0  # four more than the limit of a table of few rows
_SOFTER_PX = 0.4  # by the factor of a variance: more than that variance grows, by any locator
_SCATTER, _MEAN = ("rows", "pooled"), ("bias",)  # the tests that have to find it
_CAMERA = ("focal_length_mm", "focal_px", "magnification", "distance", "working_distance_mm")
_FOLLOWS = {"focal_px": ("focal_length_mm", "magnification"), "distance": ("working_distance_mm",)}  # of a data sheet
_STEP, _STEP_DEG = 1e-4, 0.02  # of a number, and of a pose: over which a value's derivative is taken
_MOST, _MOST_DEG = 0.1, 5.0  # part of a number, and angle, that are planted
_LINEAR = 0.8  # of the shift that is wanted: what moves less, moves nothing to first order
_PIXELS = 1 << 24  # in memory at a time
_AT_ONCE = 50
Spoiled = tuple[str, str, np.ndarray, Noise]


@dataclass(frozen=True)
class Control:
    """One wrong parameter, and whether it was found.

    Attributes
    ----------
    name, planted : str
        What is wrong, as the scene's file names it, and by how much.
    wanted : tuple of str
        Tests of which one has to contradict (`statistics.Verdict.reasons`); empty where nothing is wrong, so that none
        may.
    found : tuple of str
        Those that did.
    pooled : float or None
        Measured over predicted variance of all rows.
    mean : float or None
        The largest mean error, in standard uncertainties of one value.
    verdict : str
    """

    name: str
    planted: str
    wanted: tuple[str, ...]
    found: tuple[str, ...]
    pooled: float | None
    mean: float | None
    verdict: str

    @property
    def holds(self) -> bool:
        """Whether what was planted was found by its test, and nothing where nothing was."""
        return bool(set(self.wanted) & set(self.found)) if self.wanted else not self.found


@dataclass(frozen=True, eq=False)
class Judge:
    """A setting of a run, its noise-free picture (height, width), and how many exposures of each kind are judged."""

    picture: Picture
    row: Row
    image: np.ndarray
    count: int
    seed: int

    @property
    def method(self) -> Method:
        """That of the run's verdict."""
        name, _, threshold = self.row.main.method.partition("@")
        return Method(name, float(threshold) if threshold else None)

    @property
    def can_judge(self) -> bool:
        """Whether the setting has a value that may be relied on, without which nothing is shown."""
        return any(is_trusted(each.status) and each.ratio is not None for each in self.row.measurands)

    @property
    def factor(self) -> float:
        """Of a variance, that so many exposures tell from 1."""
        return math.exp(_SURE * math.sqrt(2 / (self.count - 1)))

    @property
    def shifts(self) -> np.ndarray:
        """Mean errors, of each value's unit, (M,), that so many exposures tell from what is allowed; infinite of what
        may not be relied on."""
        rows = self.row.measurands
        good = [is_trusted(each.status) and each.ratio is not None for each in rows]
        variance, noise = (np.array(each) for each in zip(*((r.predicted, r.render_noise) for r in rows), strict=True))
        u = np.sqrt(variance + np.array([each.u_bias or 0.0 for each in rows]) ** 2)
        return np.where(good, statistics.ALLOWANCE * u + _SURE * np.sqrt(variance / self.count + noise**2), np.inf)

    def verdict(
        self, stream: int, image: np.ndarray, noise: Noise, believed: Picture | None = None, factor: float = 1.0
    ) -> Verdict:
        """On exposures of an image, measured by who believes a picture; predicted variances are multiplied."""
        at, rng = (
            believed or self.picture,
            np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(stream,))),
        )
        where = measure.region_of_interest(self.picture)
        sizes = batches(self.count, max(1, min(_AT_ONCE, _PIXELS // image.size)))
        (found,) = remeasured(at, (render.expose(image, noise, rng, many, where) for many in sizes), (self.method,))
        return self._judged([Sample.of(column) for column in found.object.T], factor)

    def _judged(self, samples: Sequence[Sample], factor: float) -> Verdict:
        rows = self.row.measurands
        predicted = np.array([factor * each.predicted for each in rows])
        return statistics.verdict(
            [sample.ratio(variance) for sample, variance in zip(samples, predicted, strict=True)],
            [sample.n - sample.failed for sample in samples],
            lost=[sample.failed for sample in samples],
            bias_px=[sample.mean - each.correction - each.value for sample, each in zip(samples, rows, strict=True)],
            predicted_bias_px=[each.predicted_bias for each in rows],
            sigma_px=np.sqrt(predicted),
            u_bias_px=[np.nan if each.u_bias is None else each.u_bias for each in rows],
            render_noise_px=[each.render_noise for each in rows],
            status=np.array([each.status for each in rows], object),
            independent=[each.independent for each in rows],
        )

    def values(self, believed: Picture) -> np.ndarray:
        """Of the noise-free image, (M,), by who believes a picture; NaN where there is none."""
        (found,) = remeasured(believed, [self.image[None]], (self.method,))
        return found.object[0]


def controls(judge: Judge, report: Callable[[int, int], None] = lambda done, of: None) -> tuple[Control, ...]:
    """All controls of a setting, the one with nothing wrong first; none where nothing of it may be relied on."""
    if not judge.can_judge:
        return ()
    spoiled, believed = tuple(_spoiled(judge)), tuple(_believed(judge))
    count, rows = 2 + len(spoiled) + len(believed), []

    def add(name: str, planted: str, wanted: tuple[str, ...], *seen, **how) -> None:
        told = judge.verdict(len(rows), *seen, **how)
        pooled, mean = (told.pooled and told.pooled.ratio), (told.bias and told.bias.largest)
        rows.append(Control(name, planted, wanted, told.reasons, pooled, mean, told.text))
        report(len(rows), count)

    image, noise = judge.image, judge.picture.scene.noise
    add("nothing", "pictures as the scene says", (), image, noise)
    for name, planted, other, louder in spoiled:
        add(name, planted, _SCATTER, other, louder)
    too_large = judge.factor
    add("predicted variance", f"{too_large:.3g} times what was predicted", _SCATTER, image, noise, factor=too_large)
    for name, planted, picture in believed:
        add(name, planted, _MEAN, image, noise, believed=picture)
    return tuple(rows)


def _spoiled(judge: Judge) -> Iterator[Spoiled]:
    """Pictures that scatter otherwise than the scene says: a key, what is planted, image and noise."""
    scene, image, factor = judge.picture.scene, judge.image, judge.factor
    noise, dark = scene.noise, scene.noise.dark_level
    if noise.sigma > 0 or noise.gain > 0:
        louder = math.sqrt(factor)
        excess = tuple((signal, factor * each) for signal, each in noise.excess)
        more = noise.model_copy(update={"sigma": louder * noise.sigma, "gain": factor * noise.gain, "excess": excess})
        name = "noise.sigma" + ", noise.gain" * (noise.gain > 0)
        yield name, f"{louder:.3g} times as noisy as the scene says", image, more
    told = f"{1 / factor:.3g} times the light that the scene says"
    yield "camera.exposure", told, dark + (image - dark) / factor, noise
    blur = scene.camera.blur_px
    softer = blur + _SOFTER_PX * factor
    seen = gaussian_filter(image, math.sqrt(softer**2 - blur**2))
    yield "camera.blur_px", f"{softer:.3g} px, where the scene says {blur:g}", seen, noise


def _believed(judge: Judge) -> Iterator[tuple[str, str, Picture]]:
    """Scenes that are wrong about the camera: key, what is planted, and the picture that is believed.

    What moves no value, to first order, or would have to be off absurdly, is left out.
    """
    picture, (polar, azimuth) = judge.picture, judge.picture.sensor
    for key, value in _numbers(picture):

        def said(step: float, key: str = key, value: float = value) -> Picture:
            return picture.with_scene(with_number(picture.scene, key, value + step))

        step = _planted(judge, said, _STEP * value, _MOST * abs(value))
        if step is not None:
            yield key, f"{value + step:.9g}, where the pictures have {value:.9g}", said(step)
    for name, turned in (
        ("sensor, polar angle", lambda step: Pose(polar + step, azimuth)),
        ("sensor, azimuth", lambda step: Pose(polar, azimuth + step)),
    ):

        def stood(step: float, turned: Callable[[float], Pose] = turned) -> Picture:
            return Picture.of(picture.scene, turned(step), picture.free_lights)

        step = _planted(judge, stood, _STEP_DEG, _MOST_DEG)
        if step is not None:
            yield name, f"{step:.4f} degrees off where the pictures are from", stood(step)


def _numbers(picture: Picture) -> Iterator[tuple[str, float]]:
    """Numbers of the camera that the scene has, by their keys, each but once: not what follows from another."""
    known = {}
    for name in _CAMERA:
        with suppress(ValueError):
            known[name] = number_at(picture.scene, f"camera.{name}")
    for name, value in known.items():
        if value and not any(other in known for other in _FOLLOWS.get(name, ())):
            yield f"camera.{name}", value


def _planted(judge: Judge, believed: Callable[[float], Picture], step: float, most: float) -> float | None:
    """The step that moves the value most moved by as much as has to be found (`Judge.shifts`); None where that is more
    than ``most``, or does not move it so far."""
    here = judge.values(believed(0.0))

    def reach(by: float) -> float:
        moved = np.abs(judge.values(believed(by)) - here) / judge.shifts
        return float(np.nanmax(moved)) if np.isfinite(moved).any() else 0.0

    least = reach(step)
    needed = abs(step) / least if least > 0 else math.inf
    return needed if needed <= most and reach(needed) >= _LINEAR else None
