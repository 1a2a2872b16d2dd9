"""Runs that are given an accuracy or a time instead of parameters."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from render import Quality
from scenes import InvalidInput
from validation.batch.campaign import Campaign
from validation.batch.job import More, Progress, run_by
from validation.batch.options import RunOptions
from validation.batch.result import Validation
from validation.batch.store import RunFile
from validation.batch.work import methods
from validation.cost.interval import LEAST, wanted
from validation.cost.model import CostModel, Proposal, combined
from validation.cost.trial import trial
from validation.remeasured import Sample

_FIRST = 0.25  # part of the images that are taken before the first look at the clock
_FINE = 0.05  # of the accuracy: a render of this sigma adds half a per cent to the half-width
_SHORT_S, _COARSE = 30.0, 0.15  # budget and accuracy of runs so short that a longer trial would be much of them
_USUAL = 0.04  # accuracy, where none is asked for
_LOOKS = 3  # at the clock, at most
_SPARE_S = 0.3  # left over is not worth another look


@dataclass(frozen=True)
class Reached:
    """What a run with a goal has reached.

    Attributes
    ----------
    asked, unit : float, str
        "half-width" or "seconds".
    model : CostModel
    choice : Proposal
    half_widths : tuple of float
        Of each setting's variance ratio, all error sources included; the widest is what was reached.
    images : tuple of int
        Measured, each setting.
    seconds : float
        From the beginning of the trial to the end of the run.
    """

    asked: float
    unit: str
    model: CostModel
    choice: Proposal
    half_widths: tuple[float, ...]
    images: tuple[int, ...]
    seconds: float

    @property
    def widest(self) -> float:
        return max(self.half_widths, default=float("inf"))

    @property
    def text(self) -> str:
        """One line."""
        few, many = min(self.images, default=0), max(self.images, default=0)
        return (
            f"Asked for: {self.unit} {self.asked:g}. Reached: half-width {self.widest:.3g} or better in every setting "
            f"that could be measured, {few} to {many} images, {self.seconds:.1f} s."
        )

    def to_json(self) -> dict[str, Any]:
        return {
            "asked": self.asked, "unit": self.unit, "half_width": self.widest, "seconds": self.seconds,
            "predicted": {"half_width": self.choice.total, "seconds": self.choice.seconds + self.model.seconds},
            "errors": self.choice.errors, "quality": vars(self.choice.rendered.quality),
            "half_widths": self.half_widths, "images": self.images,
        }  # fmt: skip


def seconds(text: str) -> float:
    """A duration: "60", "60s", "2min", "1h".

    Examples
    --------
    >>> seconds("60s"), seconds("2min")
    (60.0, 120.0)
    """
    found = re.fullmatch(r"(\d+(?:\.\d*)?)\s*(s|min|h)?", text.strip())
    if not found or not float(found[1]):
        raise InvalidInput(f"--budget must be a duration as 60s, 2min or 1h, got {text!r}")
    return float(found[1]) * {None: 1, "s": 1, "min": 60, "h": 3600}[found[2]]


def check_accuracy(accuracy: float) -> float:
    if not 0 < accuracy < 1:
        raise InvalidInput(f"--accuracy must be between 0 and 1, got {accuracy:g}")
    return accuracy


@dataclass(frozen=True)
class Goal:
    """What a run is to reach: an accuracy, or as much of it as a time allows.

    Attributes
    ----------
    accuracy : float, optional
        Half-width of the 95 % interval on each setting's variance ratio, all error sources included.
    budget : float, optional
        Seconds, instead, from ``started`` on (`time.perf_counter`).
    """

    accuracy: float | None = None
    budget: float | None = None
    started: float = field(default_factory=lambda: time.perf_counter())

    def __post_init__(self) -> None:
        if self.accuracy is not None:
            check_accuracy(self.accuracy)

    @property
    def asked(self) -> tuple[float, str]:
        """Number and unit."""
        return (self.accuracy, "half-width") if self.budget is None else (self.budget, "seconds")

    def trial(self, campaign: Campaign, options: RunOptions) -> CostModel:
        """What the run will cost; of short runs a shorter trial."""
        short = (self.budget or np.inf) <= _SHORT_S or (self.accuracy or 0.0) >= _COARSE
        return trial(campaign, options, 2 if short else 3, _FINE * (self.accuracy or _USUAL))

    def choice(self, model: CostModel) -> Proposal:
        """Rays and images that reach it."""
        if self.accuracy is not None:
            return model.for_accuracy(self.accuracy)
        return model.for_budget(self.started + self.budget - time.perf_counter())

    def stages(self, campaign: Campaign, model: CostModel, choice: Proposal) -> tuple[int, More]:
        """The first images of each setting, and what asks for more of them."""
        if self.accuracy is not None:
            return max(LEAST, int(0.8 * choice.renders)), _Narrower(campaign, model, choice, self.accuracy)
        return max(LEAST, int(_FIRST * choice.renders)), _Longer(model, choice, self.started + self.budget)


def reach(
    campaign: Campaign,
    goal: Goal,
    options: RunOptions = RunOptions(),
    say: Callable[[str], None] = lambda line: None,
    progress: Progress | None = None,
) -> tuple[Validation, Reached]:
    """Run to an accuracy, or for a time.

    Parameters
    ----------
    campaign : Campaign
    goal : Goal
    options : RunOptions
        The quality of the renders is chosen.
    say : callable
        Given one line about what was chosen, before the run.

    Raises
    ------
    InvalidInput
        If the accuracy cannot be reached whatever the time, or the budget is too short.
    """
    model = goal.trial(campaign, options)
    choice = goal.choice(model)
    first, more = goal.stages(campaign, model, choice)
    say(f"{choice.text}; trial {model.seconds:.1f} s")
    first, quality = _begun(options) or (first, choice.rendered.quality)
    options = replace(options, rendering=replace(options.rendering, quality=quality))
    found = run_by(options, campaign, first, progress, more)
    widths, counts = _widths(found, model, choice)
    return found, Reached(*goal.asked, model, choice, widths, counts, time.perf_counter() - goal.started)


def _begun(options: RunOptions) -> tuple[int, Quality] | None:
    """First images and quality of a run that was begun in a directory: it goes on with them."""
    if options.fresh or options.out is None or not (Path(options.out) / "run.sqlite").exists():
        return None
    store = RunFile.reopen(Path(options.out))
    try:
        identity = store.identity()
        return identity["renders"], Quality(**identity["quality"])
    finally:
        store.close()


def _widths(found: Validation, model: CostModel, choice: Proposal) -> tuple[tuple[float, ...], tuple[int, ...]]:
    """Half-width of each measured setting's ratio, all sources together, and its images."""
    rows = (row.main for row in found.rows if row.main.ratio is not None)
    each = [(row.ratio * combined(model.errors(choice.rendered, row.n - row.failed)), row.n) for row in rows]
    return tuple(width for width, _ in each), tuple(n for _, n in each)


@dataclass
class _Narrower:
    """Asks for more images of those settings whose interval is still too wide (`interval.wanted`)."""

    campaign: Campaign
    model: CostModel
    choice: Proposal
    accuracy: float

    def __call__(self, store: RunFile) -> Sequence[int]:
        return [self._setting(store, index) for index in range(len(self.campaign))]

    def _setting(self, store: RunFile, index: int) -> int:
        there = sum(store.chunks(index).values())
        if not there:
            return 0
        main = methods(self.campaign.case(index).scene)[0].name
        values, (propagated, _, _) = store.distances(index, main), store.propagated(index, main)
        sample = Sample.of(values)
        good, ratio = sample.n - sample.failed, sample.ratio(propagated)
        if good < LEAST or not np.isfinite(ratio):
            return there  # more of what cannot be measured does not help
        width = ratio * self.model.sampling_for(self.choice.rendered, min(self.accuracy / ratio, 0.999))
        if not width > 0:
            return there  # the other error sources alone are wider: `Reached` tells
        return int(np.ceil(wanted(ratio, good, width) * there / good))


class _Longer:
    """Asks for the images that fit into the time left, as the images so far have shown."""

    def __init__(self, model: CostModel, choice: Proposal, deadline: float) -> None:
        self._model, self._choice, self._deadline, self._looks = model, choice, deadline, 0
        self._last = time.perf_counter() + model.start
        self._done = 0

    def __call__(self, store: RunFile) -> Sequence[int] | None:
        now, spent = time.perf_counter(), store.seconds()
        left = self._deadline - now - self._model.finish
        if self._looks == _LOOKS or left < _SPARE_S:
            return None
        images = store.images()
        settings = sum(spent.get(name, 0.0) for name in ("predict", "render", "propagate")) if not self._done else 0.0
        whole = sum(spent.values())
        share = 1 - settings / whole  # of the working time that went into images
        per_image = (now - self._last) * share / max(images - self._done, 1)
        self._looks, self._last, self._done = self._looks + 1, now, images
        part = 1.0 if self._looks == _LOOKS else 0.8
        extra = int(part * left / per_image / self._model.settings)
        per_setting = images // self._model.settings
        return [per_setting + extra] * self._model.settings if extra > 0 else None
