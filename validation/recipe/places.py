"""Where a picture is looked at: the locator's function across edges, of all places of one by a product or two. NumPy
alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from measure.estimators.windows import places_across, second_derivatives

_LARGE, _BANDS = 1 << 20, 2  # bytes of weights from which on bands, which read less of them, take less time


class Band(NamedTuple):
    """Some of the T places across an edge, one after another: which columns of `Places.near` the function depends on
    there, and by how much, (M, t, w)."""

    columns: slice
    weights: np.ndarray


@dataclass(frozen=True, eq=False)
class Places:
    """M places of an edge or a rim, at each of which a function is known at T places across.

    Attributes
    ----------
    near : ndarray of int, shape (M, W)
        Numbers of the pixels that the function of each place depends on, from one side of the edge to the other, so
        that places across that follow each other depend on some that do; one of them once more where they are fewer.
    bands : tuple of Band
    first : float
        The first place across the edge, px.
    gain, slope_to_contrast : ndarray, shape (M,)
        As of `measure.estimators.crossing.CrossingLocator`.
    """

    near: np.ndarray
    bands: tuple[Band, ...]
    first: float
    gain: np.ndarray
    slope_to_contrast: np.ndarray

    @classmethod
    def of(
        cls, at: np.ndarray, normals: np.ndarray, gain: np.ndarray, slope_to_contrast: np.ndarray,
        locator: tuple[float, float], shape: tuple[int, int],
    ) -> Places:  # fmt: skip
        """Of places (M, 2) and normals there, a locator's scale and window, px, and the picture's shape, by whose flat
        indices pixels are numbered."""
        scale_px, window_px = locator
        offsets, across, toward = places_across(at, normals, window_px)
        values, first = second_derivatives(across, toward, scale_px)
        grid = np.arange(values.shape[1])
        flat = (first[:, 1, None, None] + grid[:, None]) * shape[1] + first[:, 0, None, None] + grid
        flat, values = flat.reshape(len(at), -1), values.reshape(len(at), offsets.size, -1)
        found = [_in_order(row, normal, shape[1]) for row, normal in zip(flat, normals, strict=True)]
        width = max(own.size for own, _ in found)
        near, weights = np.empty((len(at), width), int), np.zeros((len(at), offsets.size, width))
        for k, (own, place) in enumerate(found):
            start = (width - own.size) // 2
            near[k], near[k, start : start + own.size] = own[0], own
            np.put_along_axis(weights[k], start + place.reshape(offsets.size, -1), values[k], 1)
        bands = np.array_split(weights, _BANDS if weights.nbytes >= _LARGE else 1, 1)
        return cls(near, tuple(map(_band, bands)), float(offsets[0]), gain, slope_to_contrast)

    def among(self, pixels: np.ndarray) -> Places:
        """The same with pixels numbered among some that are in order, (P,)."""
        return replace(self, near=np.searchsorted(pixels, self.near))

    def profiles(self, levels: np.ndarray) -> list[np.ndarray]:
        """The function, (t, M) of each band, of the grey levels (P,) of all pixels."""
        own = levels.take(self.near)
        return [np.vecdot(weights, own[:, None, columns]).T for columns, weights in self.bands]

    @cached_property
    def used(self) -> np.ndarray:
        """Which pixels the places depend on, in order, (Q,)."""
        return np.unique(self.near)

    def responses(self, maps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which pixels the places depend on, (Q,), and the derivatives (k, Q) by these of sums ``maps`` (k, M) of the
        offsets that unit contrast would show there."""
        place = np.searchsorted(self.used, self.near).ravel()
        unit = (self.slope_to_contrast * self.gain)[:, None] * self.middle
        rows = [np.bincount(place, (row[:, None] * unit).ravel(), self.used.size) for row in maps]
        return self.used, np.array(rows)

    @property
    def middle(self) -> np.ndarray:
        """By how much the function at the edge itself depends on the pixels, (M, W)."""
        found, across = np.zeros(self.near.shape), sum(weights.shape[1] for _, weights in self.bands) // 2
        for columns, weights in self.bands:
            if 0 <= across < weights.shape[1]:
                found[:, columns] = weights[:, across]
            across -= weights.shape[1]
        return found


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Places of several edges or rims, one after another, M in all."""

    each: tuple[Places, ...]

    def profiles(self, levels: np.ndarray) -> np.ndarray:
        """The function at all places, (T, M), of the grey levels (P,) of all pixels."""
        found = [each.profiles(levels) for each in self.each]
        return np.concatenate([np.concatenate(band, 1) for band in zip(*found, strict=True)])

    @property
    def first(self) -> float:
        """The first place across, px."""
        return self.each[0].first

    @cached_property
    def sizes(self) -> np.ndarray:
        """How many places each has."""
        return np.array([each.gain.size for each in self.each], int)

    @cached_property
    def gain(self) -> np.ndarray:
        """Of all, (M,)."""
        return np.concatenate([each.gain for each in self.each])

    @cached_property
    def slope_to_contrast(self) -> np.ndarray:
        """Of all, (M,)."""
        return np.concatenate([each.slope_to_contrast for each in self.each])

    @cached_property
    def gain_of_noise(self) -> np.ndarray:
        """Standard deviation of the function for that of a pixel, (M,)."""
        return np.sqrt(np.concatenate([(each.middle**2).sum(1) for each in self.each]))


def _in_order(flat: np.ndarray, normal: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Different flat indices of pixels along a normal, and at which of them each of all is."""
    own, number = np.unique(flat, return_inverse=True)
    row, column = np.divmod(own, width)
    order = np.argsort(column * normal[0] + row * normal[1], kind="stable")
    place = np.empty(own.size, int)
    place[order] = np.arange(own.size)
    return own[order], place[number]


def _band(weights: np.ndarray) -> Band:
    """Of weights (M, t, W)."""
    used = np.flatnonzero(weights.any((0, 1)))
    columns = slice(int(used[0]), int(used[-1]) + 1)
    return Band(columns, np.ascontiguousarray(weights[:, :, columns]))
