"""Functions of two angles, enclosed over boxes: between which numbers all their values and slopes lie.

Interval arithmetic with automatic differentiation: values as intervals, slopes as middles and radii (Moore, Kearfott
and Cloud, Introduction to Interval Analysis, 2009). With slopes known to lie in G, f(x) lies in f(c) + G (x - c), c the
box's middle; that range is intersected with the plain one after each operation, so that what encloses is wider than
the function's own range by the square of the box only. Rounding is not followed step by step: who uses a bound leaves
`ROUNDING` of it, ten thousand times what a few thousand operations of double precision lose.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

ROUNDING = 1e-9  # relative
HUGE = 1e60  # stands for what is not bounded; its square is a number, too


@dataclass(frozen=True, eq=False)
class Enclosed:
    """A function over n boxes.

    Attributes
    ----------
    half : ndarray, shape (2, n)
        Half the boxes' widths, rad.
    middle, low, high : ndarray, shape (n, ...)
        The value in the middle of each box; no value of the box is lower or higher.
    slope, spread : ndarray, shape (2, n, ...)
        No derivative by one of the angles is further from ``slope`` than ``spread``.

    Examples
    --------
    >>> x, _ = variables(np.array([[0.9, 1.1]]), np.array([[0.0, 0.0]]))
    >>> squared = x * x
    >>> round(float(squared.low[0]), 6), round(float(squared.high[0]), 6)
    (0.81, 1.21)
    """

    half: np.ndarray
    middle: np.ndarray
    low: np.ndarray
    high: np.ndarray
    slope: np.ndarray
    spread: np.ndarray

    @classmethod
    def made(
        cls, half: np.ndarray, middle: np.ndarray, low: np.ndarray, high: np.ndarray, slope: np.ndarray,
        spread: np.ndarray,
    ) -> Enclosed:  # fmt: skip
        """With the range that the slopes leave."""
        spread = np.where(spread < HUGE, spread, HUGE)  # NaN, too
        slope = np.where(np.abs(slope) < HUGE, slope, 0.0)
        steps = half.reshape(2, -1, *(1,) * (slope.ndim - 2))
        reach = ((np.abs(slope) + spread) * steps).sum(0)
        known = np.isfinite(middle)
        low = np.fmax(np.where(np.isnan(low), -HUGE, low), np.where(known, middle - reach, -HUGE))
        high = np.fmin(np.where(np.isnan(high), HUGE, high), np.where(known, middle + reach, HUGE))
        return cls(half, middle, np.maximum(low, -HUGE), np.minimum(high, HUGE), slope, spread)

    def __getitem__(self, which: Any) -> Enclosed:
        """Some of its places, as of an array (n, ...) by an index that keeps the boxes."""
        parts = (part[which] for part in (self.middle, self.low, self.high))
        both = which if isinstance(which, tuple) else (which,)
        return Enclosed(self.half, *parts, *(part[(slice(None), *both)] for part in (self.slope, self.spread)))

    def of_boxes(self, some: np.ndarray) -> Enclosed:
        """Of some of the boxes alone."""
        parts = (part[some] for part in (self.middle, self.low, self.high))
        return Enclosed(self.half[:, some], *parts, self.slope[:, some], self.spread[:, some])

    def wide(self, count: int = 1) -> Enclosed:
        """With so many axes more, of length 1."""
        return self[(..., *(None,) * count)]

    def sum(self, axis: int = -1) -> Enclosed:
        """Of numbers along an axis, counted from the last."""
        parts = (part.sum(axis) for part in (self.middle, self.low, self.high, self.slope, self.spread))
        return Enclosed.made(self.half, *parts)

    def __neg__(self) -> Enclosed:
        return Enclosed(self.half, -self.middle, -self.high, -self.low, -self.slope, self.spread)

    def __add__(self, other: Enclosed | np.ndarray | float) -> Enclosed:
        if not isinstance(other, Enclosed):
            parts = (part + other for part in (self.middle, self.low, self.high))
            zero = np.zeros(np.shape(other))
            return Enclosed(self.half, *parts, self.slope + zero, self.spread + zero)
        pairs = ("middle", "low", "high", "slope", "spread")
        return Enclosed.made(self.half, *(getattr(self, name) + getattr(other, name) for name in pairs))

    __radd__ = __add__

    def __sub__(self, other: Enclosed | np.ndarray | float) -> Enclosed:
        return self + (-other)

    def __rsub__(self, other: np.ndarray | float) -> Enclosed:
        return -self + other

    def __mul__(self, other: Enclosed | np.ndarray | float) -> Enclosed:
        if not isinstance(other, Enclosed):
            other = np.asarray(other, float)
            ends = self.low * other, self.high * other
            parts = np.minimum(*ends), np.maximum(*ends), self.slope * other, self.spread * np.abs(other)
            return Enclosed(self.half, self.middle * other, *parts)
        ends = [one * two for one in (self.low, self.high) for two in (other.low, other.high)]
        low, high = np.minimum.reduce(ends), np.maximum.reduce(ends)
        (one, wide_one), (two, wide_two) = self._ball, other._ball
        slope = self.slope * two + other.slope * one
        spread = _product_spread(self.slope, self.spread, two, wide_two)
        spread = spread + _product_spread(other.slope, other.spread, one, wide_one)
        return Enclosed.made(self.half, self.middle * other.middle, low, high, slope, spread)

    __rmul__ = __mul__

    def __truediv__(self, other: Enclosed | np.ndarray | float) -> Enclosed:
        return self * (other.inverse() if isinstance(other, Enclosed) else 1 / np.asarray(other, float))

    @property
    def _ball(self) -> tuple[np.ndarray, np.ndarray]:
        """Middle and half width of its range."""
        return (self.low + self.high) / 2, (self.high - self.low) / 2

    def of(self, function: Callable, slopes: Callable, *, rising: bool) -> Enclosed:
        """A monotone function of it, whose derivative is monotone, too."""
        with np.errstate(all="ignore"):
            low, high = function(self.low), function(self.high)
            ends = slopes(self.low), slopes(self.high)
            if not rising:
                low, high = high, low
            middle = function(self.middle)
        ends = [np.where(np.isnan(end), HUGE, np.clip(end, -HUGE, HUGE)) for end in ends]
        size, wide = (ends[0] + ends[1]) / 2, np.abs(ends[0] - ends[1]) / 2
        spread = _product_spread(self.slope, self.spread, size, wide)
        return Enclosed.made(self.half, middle, low, high, self.slope * size, spread)

    def square(self) -> Enclosed:
        """Its square."""
        ends = self.low**2, self.high**2
        low = np.where((self.low < 0) & (self.high > 0), 0.0, np.minimum(*ends))
        size, wide = self._ball
        spread = 2 * _product_spread(self.slope, self.spread, size, wide)
        return Enclosed.made(self.half, self.middle**2, low, np.maximum(*ends), 2 * self.slope * size, spread)

    def sqrt(self) -> Enclosed:
        """Its square root; of what may be negative that of 0."""
        kept = self.at_least(0.0)
        return kept.of(np.sqrt, lambda x: 0.5 / np.sqrt(x), rising=True)

    def inverse(self) -> Enclosed:
        """1 / it; without bound where it may be 0."""
        safe = (self.low > 0) | (self.high < 0)
        found = self.of(lambda x: 1 / x, lambda x: -1 / x**2, rising=False)
        wild = ~safe
        if not wild.any():
            return found
        positive = wild & (self.low >= 0)  # 1 / high is still a lower bound
        with np.errstate(divide="ignore"):
            low = np.where(wild, np.where(positive, np.minimum(1 / self.high, HUGE), -HUGE), found.low)
        return Enclosed(
            self.half, found.middle, low, np.where(wild, HUGE, found.high), np.where(wild, 0.0, found.slope),
            np.where(wild, HUGE, found.spread),
        )  # fmt: skip

    def at_least(self, least: float) -> Enclosed:
        """The larger of it and a number."""
        slope, spread = self.slope, self.spread
        bent, flat = self.low < least, self.high <= least
        size = (np.abs(slope) + spread) / 2
        side = np.sign(slope) * size  # slopes between 0 and its own
        some = np.where(bent, side, slope), np.where(bent, size, spread)
        wide = np.abs(slope) < spread  # of either sign: its own slopes have 0 among them
        some = np.where(wide, slope, some[0]), np.where(wide, spread, some[1])
        parts = (np.maximum(part, least) for part in (self.middle, self.low, self.high))
        return Enclosed.made(self.half, *parts, *(np.where(flat, 0.0, part) for part in some))

    def kept(self, least: np.ndarray | float, most: np.ndarray | float = HUGE) -> Enclosed:
        """The same of those places alone at which it is between two numbers.

        They need not be one piece of a box, nor hold its middle, so that slopes tell nothing where any are left out.
        """
        cut = (self.low < least) | (self.high > most)
        low, high = np.clip(self.low, least, most), np.clip(self.high, least, most)
        middle, spread = np.where(cut, np.nan, self.middle), np.where(cut, HUGE, self.spread)
        return Enclosed(self.half, middle, low, high, self.slope, spread)

    def known(self, least: np.ndarray | float, most: np.ndarray | float) -> Enclosed:
        """The same, which is known to lie between two numbers."""
        low, high = np.clip(self.low, least, most), np.clip(self.high, least, most)
        return Enclosed(self.half, self.middle, low, high, self.slope, self.spread)

    def absolute(self) -> Enclosed:
        """Its size."""
        return either(self.high <= 0, self.low < 0, -self, self) if (self.low < 0).any() else self

    def larger(self, other: Enclosed) -> Enclosed:
        """The larger of two."""
        more = either(self.high <= other.low, self.low < other.high, other, self, of_middle=other.middle > self.middle)
        low, high = (np.maximum(getattr(self, end), getattr(other, end)) for end in ("low", "high"))
        return Enclosed.made(more.half, more.middle, low, high, more.slope, more.spread)


def either(
    sure: np.ndarray, possible: np.ndarray, one: Enclosed, other: Enclosed, of_middle: np.ndarray | None = None
) -> Enclosed:
    """One function where surely so, the other where that is not possible, else what encloses both.

    They must agree where one takes over from the other. ``of_middle`` tells which it is in the middle of each box; by
    default the larger of both.
    """
    both = possible & ~sure
    with np.errstate(invalid="ignore"):
        where = one.middle >= other.middle if of_middle is None else of_middle
    middle = np.where(sure | (both & where), one.middle, other.middle)
    low = np.where(sure, one.low, np.where(both, np.fmin(one.low, other.low), other.low))
    high = np.where(sure, one.high, np.where(both, np.fmax(one.high, other.high), other.high))
    ends = [(part.slope - part.spread, part.slope + part.spread) for part in (one, other)]
    least, most = np.fmin(ends[0][0], ends[1][0]), np.fmax(ends[0][1], ends[1][1])
    slope = np.where(sure, one.slope, np.where(both, (least + most) / 2, other.slope))
    spread = np.where(sure, one.spread, np.where(both, (most - least) / 2, other.spread))
    return Enclosed.made(one.half, middle, low, high, slope, spread)


def _product_spread(slope: np.ndarray, spread: np.ndarray, size: np.ndarray, wide: np.ndarray) -> np.ndarray:
    """How far slopes times numbers within ``wide`` of ``size`` may be from the middles' product."""
    return np.abs(slope) * wide + spread * (np.abs(size) + wide)


def variables(first: np.ndarray, second: np.ndarray) -> tuple[Enclosed, Enclosed]:
    """Both angles themselves, rad, of boxes (n, 2), (n, 2): from and to."""
    half = np.stack([np.ptp(part, axis=1) / 2 for part in (first, second)])
    made = []
    for k, part in enumerate((first, second)):
        slope = np.zeros((2, len(part)))
        slope[k] = 1.0
        made.append(Enclosed(half, part.mean(1), part[:, 0], part[:, 1], slope, np.zeros_like(slope)))
    return made[0], made[1]


def sine(angle: Enclosed) -> Enclosed:
    """Of an angle, rad."""
    return _wave(angle, 0.0)


def cosine(angle: Enclosed) -> Enclosed:
    """Of an angle, rad."""
    return _wave(angle, np.pi / 2)


def _wave(angle: Enclosed, ahead: float) -> Enclosed:
    low, high = _range_of_sine(angle.low + ahead, angle.high + ahead)
    slopes = _range_of_sine(angle.low + ahead + np.pi / 2, angle.high + ahead + np.pi / 2)
    size, wide = (slopes[0] + slopes[1]) / 2, (slopes[1] - slopes[0]) / 2
    spread = _product_spread(angle.slope, angle.spread, size, wide)
    return Enclosed.made(angle.half, np.sin(angle.middle + ahead), low, high, angle.slope * size, spread)


def _range_of_sine(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least and the largest sine from one angle to another."""

    def crest(at: float) -> np.ndarray:
        return np.floor((high - at) / (2 * np.pi)) >= np.ceil((low - at) / (2 * np.pi))

    ends = np.sin(low), np.sin(high)
    return np.where(crest(-np.pi / 2), -1.0, np.minimum(*ends)), np.where(crest(np.pi / 2), 1.0, np.maximum(*ends))
