"""Straight edges at their known places: points along each, a line through them, covariance, status. NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from measure.estimators import crossings
from measure.features.aligned import Aligned
from measure.features.lines import (
    at_ends,
    by_noise,
    capture,
    edge_states,
    end_errors,
    fit_lines,
    inverse_contrast,
    level_and_slope,
    line_state,
    trapezoid,
)
from scenes import status
from validation.recipe.places import SideBySide
from validation.recipe.sensor import Seen, Sensor

_NO_PLACE = np.zeros((4, 1))  # of what is told of places: there is none


class FoundEdges(NamedTuple):
    """E edges of one picture.

    Attributes
    ----------
    lines : ndarray, shape (E, 2)
        Offset at the start of each expected edge, px, and slope; NaN where it is not found.
    covariance : ndarray, shape (2 E, 2 E)
        Of these, in their order.
    states : list of str
    displaced : bool
        Whether they have to be looked for elsewhere.
    """

    lines: np.ndarray
    covariance: np.ndarray
    states: list[str]
    displaced: bool


class Padded(NamedTuple):
    """Of the places of S edges, each edge a row, (S, m): their numbers among all, one more where there is none; which
    there are; along the edge, px; how much of it each stands for; start, middle and end of these places, (S, 3)."""

    numbers: np.ndarray
    there: np.ndarray
    along: np.ndarray
    even: np.ndarray
    middles: np.ndarray


class Means(NamedTuple):
    """What takes means over the places of each of S edges: over all, over the first half and the second, (3, S, m);
    over steps from place to place, (S, m - 1)."""

    places: np.ndarray
    steps: np.ndarray


@dataclass(frozen=True, eq=False)
class Edges:
    """E edges, of which S can be measured, each at places of its own.

    Attributes
    ----------
    fixed : ndarray of str, shape (E,)
        Statuses, as far as geometry alone tells.
    lengths : ndarray, shape (E,)
        Of the expected images, px.
    shown : ndarray of int, shape (S,)
        Which can be measured.
    starts : ndarray of int, shape (S + 1,)
        Where the places of each begin among all.
    along : ndarray, shape (m,)
        Along its edge of each place, px.
    places : SideBySide
        Of those that can be measured.
    sensor : Sensor
    limits : tuple of float
        Least contrast over noise, and how far off an edge is caught, px.
    aligned : Aligned or None
        What tells whether edges are elsewhere; of the picture's pixels.
    """

    fixed: np.ndarray
    lengths: np.ndarray
    shown: np.ndarray
    starts: np.ndarray
    along: np.ndarray
    places: SideBySide
    sensor: Sensor
    limits: tuple[float, float]
    aligned: Aligned | None

    def find(self, seen: Seen, image: np.ndarray) -> FoundEdges:
        """In a picture (height, width), by what is seen of it."""
        edges = len(self.fixed)
        lines, covariance = np.full((edges, 2), np.nan), np.zeros((edges, 2, edges, 2))
        found = np.full(edges, status.LOW_CONTRAST, object)
        if self.shown.size:
            lines[self.shown], covariance[self.shown, :, self.shown], found[self.shown] = self._lines(seen)
        covariance = covariance.reshape(2 * edges, 2 * edges)
        states = edge_states(self.fixed, found).tolist()
        return FoundEdges(lines, covariance, states, edges > 0 and self._are_elsewhere(lines, covariance, image))

    def _lines(self, seen: Seen) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(level, slope) of the edges that can be measured, (S, 2), their covariances (S, 2, 2) and statuses (S,)."""
        padded, places = self._padded, self.places
        signed, turned = self._turned(places.profiles(seen.levels))
        variances, moments = self._noise_in(seen)
        best = crossings.surest(signed[None])  # each place as an image by itself: sums then run along rows
        offset, valid, slope = crossings.located(places.first, best)
        spread = places.gain_of_noise * np.sqrt(np.repeat(variances[0], places.sizes))
        counts = crossings.counted(best, spread, len(signed))
        each = offset * places.gain, valid, places.slope_to_contrast * slope, counts
        offset, valid, contrast, counts = np.concatenate([np.concatenate(each), _NO_PLACE], 1).take(padded.numbers, 1)
        points = crossings.edge_points(padded.along, offset, valid > 0, contrast, padded.even, counts, turned)
        found = fit_lines(points, points.weights, padded.there)
        level, tilt, contrast = level_and_slope(points, found)
        state = line_state(points, found, places.sizes, self.limits[0], variances[1])
        inverse = inverse_contrast(contrast, padded.middles)
        return np.stack([level, tilt], -1), np.einsum("ej,ek,eajbk->eab", inverse, inverse, moments), state

    def _turned(self, profiles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Profiles (T, m) that are positive on the darker side of each edge, and whether edges change theirs."""
        (up,) = crossings.rise(profiles[None])
        every, first, second = self._means.places @ up
        turned = crossings.are_opposite(first, second, self._means.steps @ np.abs(up[1:] - up[:-1]))
        return profiles * np.repeat(np.where(every >= 0, 1.0, -1.0), self.places.sizes), turned

    def _noise_in(self, seen: Seen) -> tuple[np.ndarray, np.ndarray]:
        """Variances (2, S) of noise at each edge's mean level, and on the mean; products of what noise does to its
        (level, slope), by contrasts at three places, (S, 2, 3, 2, 3)."""
        if seen.variance is not None:
            return np.full((2, self.shown.size), seen.variance), seen.variance * self._products
        variances, moments = np.empty((2, self.shown.size)), np.empty(self._products.shape)
        for k, (pixels, rows) in enumerate(self._responses):
            levels, sensor = seen.levels[pixels], self.sensor
            variance = sensor.variance(levels)
            variances[0, k] = np.mean(sensor.variance(levels.mean(keepdims=True)))
            variances[1, k] = np.mean(variance) if sensor.shot_gain > 0 else sensor.noise_variance
            moments[k] = ((rows * variance) @ rows.T).reshape(2, 3, 2, 3)
        return variances, moments

    def _are_elsewhere(self, lines: np.ndarray, covariance: np.ndarray, image: np.ndarray) -> bool:
        """Whether a line lies farther off than it is caught, and all edges are where a shift or a turn takes them."""
        if self.shown.size < len(self.fixed):
            return False
        offsets = np.abs(at_ends(*lines.T[:, None], self.lengths))
        if self.aligned is None or (offsets <= self.limits[1]).all():
            return False
        if (offsets <= capture(self.limits[1], end_errors(covariance[None], self.lengths))).all():
            return False
        return bool(self.aligned.poses(image.reshape(1, -1)).any())

    @property
    def _parts(self) -> list[slice]:
        return [slice(*pair) for pair in zip(self.starts.tolist(), self.starts[1:].tolist(), strict=False)]

    @cached_property
    def _padded(self) -> Padded:
        there = np.arange(max(self.places.sizes, default=0)) < self.places.sizes[:, None]
        numbers, (along, even) = np.full(there.shape, self.along.size), np.zeros((2, *there.shape))
        numbers[there], along[there] = np.arange(self.along.size), self.along
        even[there] = np.concatenate([trapezoid(self.along[part]) for part in self._parts])
        middles = np.array([np.linspace(*self.along[part][[0, -1]], 3) for part in self._parts])
        return Padded(numbers, there, along, even, middles)

    @cached_property
    def _means(self) -> Means:
        rows = np.zeros((4, len(self._parts), len(self.along)))
        for k, part in enumerate(self._parts):
            numbers = np.arange(part.start, part.stop)
            each = (numbers, *np.array_split(numbers, 2), numbers[:-1])
            for row, some in zip(rows[:, k], each, strict=True):
                row[some] = 1 / some.size
        return Means(rows[:3], rows[3, :, :-1].copy())

    @cached_property
    def _responses(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each edge its pixels among those that are read, and what they do to (level, slope), (6, Q)."""
        each = zip(self.places.each, self._parts, self._padded.middles, strict=True)
        return [
            places.responses(by_noise(self.along[part], trapezoid(self.along[part]), middle))
            for places, part, middle in each
        ]

    @cached_property
    def _products(self) -> np.ndarray:
        return np.array([rows @ rows.T for _, rows in self._responses]).reshape(-1, 2, 3, 2, 3)
