"""Do the values scatter as predicted? A picture is rendered, exposed many times, each image measured, and compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

import measure
import render
from measure.measurands import exposures_by
from measure.propagation import PropagatedValues
from render import Quality
from scenes import Picture
from validation.statistics import ratio_interval


@dataclass(frozen=True)
class Method:
    """A locator, with its gradient threshold if it has one."""

    locator: str
    threshold: float | None = None

    @property
    def name(self) -> str:
        """Name in tables and in the run file: "gradient", "canny@12"."""
        return self.locator if self.threshold is None else f"{self.locator}@{self.threshold:g}"


GRADIENT = Method("gradient")  # whose closed form the calibrated model is


@dataclass(frozen=True, eq=False)
class MeasuredValues:
    """What one method measured in n images: M measurands in image and object, NaN for none, and statuses, (n, M)."""

    image: np.ndarray
    object: np.ndarray
    status: np.ndarray


@dataclass(frozen=True)
class Sample:
    """The values of a measurand in n images, ``failed`` of them without one: mean and variance, NaN of too few."""

    n: int
    failed: int
    mean: float
    variance: float

    @classmethod
    def of(cls, values: np.ndarray) -> Sample:
        """Of values (n,), NaN where there is none.

        >>> Sample.of(np.array([1.0, 3.0, np.nan]))
        Sample(n=3, failed=1, mean=2.0, variance=2.0)
        """
        good = values[np.isfinite(values)]
        mean = float(good.mean()) if good.size else math.nan
        return cls(values.size, values.size - good.size, mean, float(good.var(ddof=1)) if good.size > 1 else math.nan)

    def ratio(self, predicted: float) -> float:
        """Sample variance over a predicted one; NaN where one of them is not known."""
        return self.variance / predicted if 0 < predicted < math.inf else math.nan

    def interval(self, predicted: float) -> tuple[float, float]:
        """Two-sided 95 % chi-square interval of that ratio."""
        return ratio_interval(self.ratio(predicted), self.n - self.failed)


def propagated(picture: Picture, quality: Quality = Quality()) -> tuple[np.ndarray, PropagatedValues]:
    """The noise-free image of a picture, rendered where it is measured, and the covariance of what `GRADIENT` finds."""
    image = render.image(picture, quality=replace(quality, everywhere=False))
    return image, measure.propagate(image, picture, estimator=GRADIENT.locator).measurands


def batches(count: int, size: int) -> Iterator[int]:
    """Numbers of images, each at most a size.

    >>> list(batches(7, 3))
    [3, 3, 1]
    """
    for first in range(0, count, size):
        yield min(size, count - first)


def remeasured(
    picture: Picture,
    exposures: Iterable[np.ndarray],
    methods: tuple[Method, ...] = (GRADIENT,),
    lap: Callable[[str], None] = lambda name: None,
) -> tuple[MeasuredValues, ...]:
    """Measure all exposures of a picture by each method.

    Parameters
    ----------
    exposures : iterable of ndarray, shape (n, height, width)
        Noisy images, a batch at a time; a generator keeps no more than one in memory.
    lap : callable
        Called with "expose", and with each method's name, when a batch has passed it.
    """
    parts: list[list[measure.Measurements]] = [[] for _ in methods]
    for images in exposures:
        lap("expose")
        for found, method in zip(parts, methods, strict=True):
            found += exposures_by(images, picture, ((method.locator, method.threshold),))
            lap(method.name)
    return tuple(_joined(found) for found in parts)


def _joined(parts: list[measure.Measurements]) -> MeasuredValues:
    columns = ([getattr(part, name) for part in parts] for name in ("value_image", "value", "status"))
    return MeasuredValues(*map(np.concatenate, columns))
