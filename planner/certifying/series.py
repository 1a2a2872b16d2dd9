"""Vectors and series of enclosed numbers."""

from __future__ import annotations

from math import comb

import numpy as np

from planner.certifying.enclosed import HUGE, Enclosed, cosine, sine

DEGREE = 6  # of the polynomials along an edge


def direction(polar: Enclosed, azimuth: Enclosed) -> list[Enclosed]:
    """Unit vector towards poses, rad, by its components."""
    across = sine(polar)
    return [across * cosine(azimuth), across * sine(azimuth), cosine(polar)]


def frame(polar: Enclosed, azimuth: Enclosed, roll: float) -> tuple[list[Enclosed], list[Enclosed]]:
    """Axes of the image, right and down, of sensors turned by ``roll``, rad (`imaging.geometry.projection`)."""
    ahead, aside, level, none = cosine(azimuth), sine(azimuth), cosine(polar), polar * 0.0
    right, down = [-aside, ahead, none], [level * ahead, level * aside, -sine(polar)]
    turned = float(np.cos(roll)), float(np.sin(roll))
    return (
        [a * turned[0] + b * turned[1] for a, b in zip(right, down, strict=True)],
        [b * turned[0] - a * turned[1] for a, b in zip(right, down, strict=True)],
    )


def dot(one: list[Enclosed], other: list[Enclosed] | np.ndarray) -> Enclosed:
    """Scalar product of vectors by their components; of arrays (..., 3) by their last axis."""
    parts = np.moveaxis(other, -1, 0) if isinstance(other, np.ndarray) else other
    first, second, third = (a * b for a, b in zip(one, parts, strict=True))
    return first + second + third


def within(fraction: Enclosed) -> Enclosed:
    """A fraction, which lies between 0 and 1 whatever its enclosure says."""
    low, high = (np.clip(part, 0.0, 1.0) for part in (fraction.low, fraction.high))
    return Enclosed(fraction.half, fraction.middle, low, high, fraction.slope, fraction.spread)


def bernstein(at: Enclosed) -> Enclosed:
    """Bernstein's polynomials of `DEGREE` at fractions (...), shape (..., DEGREE + 1)."""

    def values(x: np.ndarray, degree: int) -> np.ndarray:
        k = np.arange(degree + 1)
        return np.array([comb(degree, i) for i in k]) * x[..., None] ** k * (1 - x[..., None]) ** (degree - k)

    def most(low: np.ndarray, high: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
        ends = values(low, degree), values(high, degree)
        peak = np.arange(degree + 1) / degree
        top = values(peak, degree).diagonal()
        inside = (low[..., None] < peak) & (peak < high[..., None])
        return np.minimum(*ends), np.where(inside, top, np.maximum(*ends))

    low, high = most(at.low, at.high, DEGREE)
    less, more = most(at.low, at.high, DEGREE - 1)
    zero = np.zeros((*less.shape[:-1], 1))
    before, after = ([np.concatenate([zero, p], -1), np.concatenate([p, zero], -1)] for p in (less, more))
    down, up = DEGREE * (before[0] - after[1]), DEGREE * (after[0] - before[1])
    size, wide = (down + up) / 2, np.abs(up - down) / 2
    slope, spread = at.slope[..., None], at.spread[..., None]
    whole = np.abs(slope) * wide + spread * (np.abs(size) + wide)
    return Enclosed.made(at.half, values(at.middle, DEGREE), low, high, slope * size, whole)


def stacked(parts: list[Enclosed]) -> Enclosed:
    """Along a new axis behind that of the cells."""
    made = [np.stack([getattr(part, name) for part in parts], 1) for name in ("middle", "low", "high")]
    both = [np.stack([getattr(part, name) for part in parts], 2) for name in ("slope", "spread")]
    return Enclosed(parts[0].half, *made, *both)


def with_last(values: Enclosed, last: Enclosed | None) -> Enclosed:
    """One more number at the end, 0 where none is given."""
    last = values[..., 0] * 0.0 if last is None else last
    made = [
        np.concatenate([getattr(values, name), getattr(last, name)[..., None]], -1)
        for name in ("middle", "low", "high", "slope", "spread")
    ]
    return Enclosed(values.half, *made)


def spread_over(made: Enclosed, here: np.ndarray, whole: Enclosed, known: Enclosed | None) -> Enclosed:
    """What some cells have among all; of cells that have another already nothing is known."""
    count, rest = len(whole.low), made.middle.shape[1:]
    if known is None:
        middle = np.full((count, *rest), np.nan)
        known = Enclosed(whole.half, middle, middle + np.inf, middle - np.inf, np.zeros((2, *middle.shape)),
                         np.zeros((2, *middle.shape)))  # fmt: skip
        known.low[:], known.high[:] = HUGE, -HUGE
    again = (known.low[here] < HUGE).any(-1)
    parts = {name: getattr(known, name).copy() for name in ("middle", "low", "high", "slope", "spread")}
    parts["middle"][here] = np.where(again[:, None], np.nan, made.middle)
    parts["low"][here] = np.minimum(parts["low"][here], made.low)
    parts["high"][here] = np.maximum(parts["high"][here], made.high)
    parts["slope"][:, here] = np.where(again[:, None], 0.0, made.slope)
    parts["spread"][:, here] = np.where(again[:, None], HUGE, made.spread)
    return Enclosed(whole.half, *parts.values())
