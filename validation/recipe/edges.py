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
from validation.recipe.places import Places
from validation.recipe.sensor import Sensor


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
    """Of the places of S edges, each edge a row, (S, m): which there are, and along the edge, px; how much of it each
    stands for; start, middle and end of these places, (S, 3)."""

    there: np.ndarray
    along: np.ndarray
    even: np.ndarray
    middles: np.ndarray


class Means(NamedTuple):
    """What takes means over the places of each of S edges: over all, (S, m); over the first half and the second; over
    steps from place to place, (S, m - 1)."""

    every: np.ndarray
    first: np.ndarray
    second: np.ndarray
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
    places : Places
        Of all that is looked at; the edges' come first.
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
    places: Places
    sensor: Sensor
    limits: tuple[float, float]
    aligned: Aligned | None

    def find(self, used: np.ndarray, profiles: np.ndarray, image: np.ndarray) -> FoundEdges:
        """In a picture (height, width), by the levels (P,) of its pixels that are read and the profiles (m, T)."""
        edges = len(self.fixed)
        lines, covariance = np.full((edges, 2), np.nan), np.zeros((edges, 2, edges, 2))
        found = np.full(edges, status.LOW_CONTRAST, object)
        if self.shown.size:
            lines[self.shown], covariance[self.shown, :, self.shown], found[self.shown] = self._lines(used, profiles)
        covariance = covariance.reshape(2 * edges, 2 * edges)
        states = edge_states(self.fixed, found).tolist()
        return FoundEdges(lines, covariance, states, edges > 0 and self._are_elsewhere(lines, covariance, image))

    def _lines(self, used: np.ndarray, profiles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(level, slope) of the edges that can be measured, (S, 2), their covariances (S, 2, 2) and statuses (S,)."""
        padded, sizes, m = self._padded, np.diff(self.starts), len(profiles)
        profiles, turned = self._turned(profiles[:, :, None], sizes)
        variances, moments = self._noise_in(used)
        spread = (self._gain_of_noise * np.sqrt(np.repeat(variances[0], sizes)))[:, None]
        best = crossings.surest(profiles)
        offset, valid, slope = crossings.located(self.places.first, *best[:3], profiles)
        counts = crossings.counted(best, spread, profiles.shape[1])
        rows = offset[:, 0] * self.places.gain[:m], self.places.slope_to_contrast[:m] * slope[:, 0], counts[:, 0]
        offset, contrast, counts = (self._by_edge(each) for each in rows)
        there = self._by_edge(valid[:, 0])
        points = crossings.edge_points(padded.along, offset, there, contrast, padded.even, counts, turned)
        found = fit_lines(points, points.weights, padded.there)
        level, tilt, contrast = level_and_slope(points, found)
        state = line_state(points, found, sizes, self.limits[0], variances[1])
        inverse = inverse_contrast(contrast, padded.middles)
        return np.stack([level, tilt], -1), np.einsum("ej,ek,eajbk->eab", inverse, inverse, moments), state

    def _turned(self, profiles: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Profiles (m, T, 1) that are positive on the darker side of each edge, and whether edges change theirs."""
        up, means = crossings.rise(profiles), self._means
        steps = np.abs(np.diff(up, axis=0))
        turned = crossings.are_opposite(means.first @ up, means.second @ up, means.steps @ steps)[:, 0]
        sign = np.where(means.every @ up >= 0, 1.0, -1.0)
        return profiles * np.repeat(sign, sizes, 0)[:, None], turned

    def _noise_in(self, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Variances (2, S) of noise at each edge's mean level, and on the mean; products of what noise does to its
        (level, slope), by contrasts at three places, (S, 2, 3, 2, 3)."""
        alike = self.sensor.variance(used)
        if isinstance(alike, float):
            return np.full((2, self.shown.size), alike), alike * self._products
        variances, moments = np.empty((2, self.shown.size)), np.empty(self._products.shape)
        for k, (pixels, rows) in enumerate(self._responses):
            levels, sensor = used[pixels], self.sensor
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

    def _by_edge(self, values: np.ndarray) -> np.ndarray:
        """Numbers (m,) of all places as rows of edges, 0 where there is no place."""
        found = np.zeros(self._padded.there.shape, values.dtype)
        found[self._padded.there] = values
        return found

    @property
    def _parts(self) -> list[slice]:
        return [slice(*pair) for pair in zip(self.starts.tolist(), self.starts[1:].tolist(), strict=False)]

    @cached_property
    def _padded(self) -> Padded:
        sizes = np.diff(self.starts)
        there = np.arange(max(sizes, default=0)) < sizes[:, None]
        along, even = np.zeros((2, *there.shape))
        along[there] = self.along
        even[there] = np.concatenate([trapezoid(self.along[part]) for part in self._parts])
        return Padded(there, along, even, np.array([np.linspace(*self.along[p][[0, -1]], 3) for p in self._parts]))

    @cached_property
    def _means(self) -> Means:
        rows = np.zeros((4, len(self._parts), len(self.along)))
        for k, part in enumerate(self._parts):
            numbers = np.arange(part.start, part.stop)
            each = (numbers, *np.array_split(numbers, 2), numbers[:-1])
            for row, some in zip(rows[:, k], each, strict=True):
                row[some] = 1 / some.size
        return Means(*rows[:3], rows[3, :, :-1])

    @cached_property
    def _responses(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each edge its pixels among those that are read, and what they do to (level, slope), (6, Q)."""
        each = zip(self._parts, self._padded.middles, strict=True)
        maps = ((by_noise(self.along[part], trapezoid(self.along[part]), middle), part) for part, middle in each)
        return [self.places.responses(*pair) for pair in maps]

    @cached_property
    def _products(self) -> np.ndarray:
        return np.array([rows @ rows.T for _, rows in self._responses]).reshape(-1, 2, 3, 2, 3)

    @cached_property
    def _gain_of_noise(self) -> np.ndarray:
        return self.places.gain_of_noise[: len(self.along)]
