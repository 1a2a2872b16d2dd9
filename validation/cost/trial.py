"""A short trial that measures the constants of the cost model on this machine."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

import measure
import planner
import render
from render import Quality
from render import variant as variants
from scenes import InvalidInput, Pose
from validation.batch import pool, work
from validation.batch.campaign import Campaign, Case
from validation.batch.options import RunOptions
from validation.cost.model import CostModel, Rendered, qualities
from validation.cost.watch import Watch, at_once
from validation.remeasured import batches

SAMPLES = (4, 16, 64)
_IMAGES = 100  # a setting
_SHIFT_DEG = (-0.5, 0.5)  # of the polar angle: moves the edges by fractions of a pixel
_PICTURE_S = 0.2  # the pictures of a run, each
Report = Callable[[str, int, int], None]


def trial(
    campaign: Campaign,
    options: RunOptions = RunOptions(),
    settings: int = 3,
    fine: float = 0.0,
    report: Report | None = None,
    watch: Watch = Watch(),
) -> CostModel:
    """Measure what the run of a campaign will cost, on a few settings spread over it.

    Parameters
    ----------
    campaign : Campaign
    options : RunOptions
        Of the run to come: its effects and workers; the seed is that of the trial's images, which are not the run's.
    settings : int
        How many to try.
    fine : float
        Relative sigma of a render's variance that is small enough: more rays are not tried.
    report : callable, optional
        As report(what, done, total).
    watch : Watch
        Once its time is over, no further setting and no more rays are tried.

    Raises
    ------
    InvalidInput
        If none of the settings can be measured.
    """
    imports, started = time.process_time(), time.perf_counter()  # so far this process has done little but import
    variant, cases = variants.choose(), spread_cases(campaign, settings)
    warm = _timed(lambda: work.render_setting(cases[0], variant, options.rendering))
    found = []
    for done in watch.samples(len(cases), least=1):
        case = cases[done]
        tell = partial(report or (lambda *_: None), "trial", done, len(cases))
        tell()
        found.append(_Tried(case, variant, options, tell))
    good = [tried for tried in found if tried.usable]
    if not good:
        raise InvalidInput(f"{campaign.name}: settings must be measurable for a trial, got {found[0].status}")
    rendered = _ladder(good, fine, watch)
    squares = [tried.linearity() for tried in good]
    model = math.sqrt(max(0.0, float(np.mean([delta**2 - se**2 for delta, se in squares]))))
    return CostModel(
        settings=len(campaign),
        workers=options.workers or pool.cores(),
        variant=variant,
        rendered=rendered,
        phase=_rms([tried.phase() for tried in good]),
        model=model,
        start=imports + max(0.0, warm - found[0].seconds),
        setting=float(np.mean([tried.overhead for tried in good])),
        image=float(np.mean([tried.image_seconds for tried in good])),
        finish=_PICTURE_S * min(len(campaign), 16),
        seconds=time.perf_counter() - started,
    )


def _ladder(tried: list[_Tried], fine: float, watch: Watch) -> tuple[Rendered, ...]:
    """From few rays to many, until they are enough."""
    rendered: list[Rendered] = []
    ladder = qualities(*SAMPLES)
    for number in watch.samples(len(ladder), least=1):
        quality = ladder[number]
        seconds, spread = zip(*(one.rendered(quality) for one in tried), strict=True)
        rendered.append(Rendered(quality, float(np.mean(seconds)), _rms(spread)))
        if rendered[-1].sigma <= fine:
            break
    return tuple(rendered)


def spread_cases(campaign: Campaign, count: int) -> list[Case]:
    """Spread over the campaign, those whose pose is impossible left out."""
    found = []
    for index in np.unique(np.linspace(0, len(campaign) - 1, count).round().astype(int)):
        try:
            found.append(campaign.case(int(index)))
        except InvalidInput as error:
            trouble = error
    if not found:
        raise trouble
    return found


class _Tried:
    """One setting of the trial."""

    def __init__(self, case: Case, variant: str, options: RunOptions, tell: Callable[[], None]) -> None:
        self.case, self.variant, self.seed, self.how, self.tell = case, variant, options.seed, options.rendering, tell
        clean = work.render_setting(case, variant, self.how)
        self.seconds = sum(clean.seconds.values())
        self.image = clean.image.array()
        self.found = self._propagate(self.image, case.setting.sensor)
        self.status = self.found.status
        self.usable = math.isfinite(self.found.variance_px2)
        self.overhead = clean.seconds["predict"] + clean.seconds["propagate"]
        work.measure_chunk(case, self.image, self.seed, 0, 2)  # prepares the estimators
        tell()
        self.image_seconds = _timed(self._measure_images) / _IMAGES

    def _measure_images(self) -> None:
        size = at_once(self.image.size, _IMAGES)
        for number, count in enumerate(batches(_IMAGES, size)):
            self.tell()
            work.measure_chunk(self.case, self.image, self.seed, number, count)

    def rendered(self, quality: Quality) -> tuple[float, float]:
        """Seconds of a render, and relative sigma of the predicted variance from two seeds."""
        began, variances = time.perf_counter(), []
        sensor = self.case.setting.sensor
        for seed in (1, 2):
            image = self._image(sensor, replace(quality, seed=seed))
            if seed == 1:
                seconds = time.perf_counter() - began
            variances.append(self._propagate(image, sensor).variance_px2)
        return seconds, float(np.std(np.log(variances), ddof=1)) if np.isfinite(variances).all() else 0.0

    def phase(self) -> float:
        """Relative sigma of propagated / calibrated variance over places of the object within a pixel."""
        logs, (sensor, light) = [], (self.case.setting.sensor, self.case.setting.light)
        for shift in (0.0, *_SHIFT_DEG):
            moved = Pose(abs(sensor.polar_deg + shift), sensor.azimuth_deg)
            try:
                image = self.image if not shift else self._image(moved, self.how.quality)
                smooth = planner.predict(self.case.scene, moved, light).variance_image
                logs.append(math.log(self._propagate(image, moved).variance_px2 / smooth))
            except (InvalidInput, ValueError):
                continue  # the object hides its edge from there
        logs = [value for value in logs if math.isfinite(value)]
        return float(np.std(logs, ddof=1)) if len(logs) > 1 else 0.0

    def linearity(self) -> tuple[float, float]:
        """Measured over linearly predicted variance for the same noise, less 1, and its standard error.

        Both variances share the noise, so their ratio is known much better than either.
        """
        scene, sensor = self.case.scene, self.case.setting.sensor
        where = measure.region_of_interest(scene, sensor)
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.case.index, 1 << 30)))
        parts, size = [], at_once(self.image.size, _IMAGES)
        for count in batches(_IMAGES, size):
            self.tell()
            pictures = render.expose(self.image, scene.noise, rng, count, where)
            found = measure.measure(pictures, scene, sensor, estimator="gradient").value_image[:, 0]
            parts.append((found, np.einsum("nij,ij->n", pictures - self.image, self.found.response)))
        values, linear = np.concatenate(parts, axis=1)
        good = np.isfinite(values)
        if good.sum() < 3:
            return 0.0, 0.0
        pair = np.cov(values[good], linear[good])
        unexplained = max(0.0, 1 - pair[0, 1] ** 2 / (pair[0, 0] * pair[1, 1]))
        return float(pair[0, 0] / pair[1, 1] - 1), 2 * math.sqrt(unexplained / (good.sum() - 1))

    def _image(self, sensor: Pose, quality: Quality) -> np.ndarray:
        self.tell()
        how = vars(self.how) | {"quality": quality}
        return render.image(self.case.scene, sensor, self.case.setting.light, variant=self.variant, **how)

    def _propagate(self, image: np.ndarray, sensor: Pose) -> measure.Propagated:
        return measure.propagate(image, self.case.scene, sensor)


def _timed(what: Callable[[], object]) -> float:
    began = time.perf_counter()
    what()
    return time.perf_counter() - began


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
