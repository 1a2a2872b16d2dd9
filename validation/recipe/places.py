"""Where a picture is looked at: the locator's function across edges, of all places by one product. NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from measure.estimators.windows import places_across, second_derivatives


@dataclass(frozen=True, eq=False)
class Places:
    """M places, at each of which a function is known at T places across the edge.

    Attributes
    ----------
    pixels : ndarray of int, shape (P,)
        Flat indices of all pixels that are read.
    near : ndarray of int, shape (M, W)
        Which of these the function of each place depends on; the first once more where they are fewer.
    weights : ndarray, shape (M, T, W)
        By how much.
    first : float
        The first place across the edge, px.
    gain, slope_to_contrast : ndarray, shape (M,)
        As of `measure.estimators.crossing.CrossingLocator`.
    """

    pixels: np.ndarray
    near: np.ndarray
    weights: np.ndarray
    first: float
    gain: np.ndarray
    slope_to_contrast: np.ndarray

    @classmethod
    def of(
        cls, at: np.ndarray, normals: np.ndarray, gain: np.ndarray, slope_to_contrast: np.ndarray,
        locator: tuple[float, float], shape: tuple[int, int],
    ) -> Places:  # fmt: skip
        """Of places (M, 2) and normals there, a locator's scale and window, px, and the picture's shape."""
        scale_px, window_px = locator
        offsets, across, toward = places_across(at, normals, window_px)
        values, first = second_derivatives(across, toward, scale_px)
        grid = np.arange(values.shape[1])
        flat = (first[:, 1, None, None] + grid[:, None]) * shape[1] + first[:, 0, None, None] + grid
        flat, values = flat.reshape(len(at), -1), values.reshape(len(at), offsets.size, -1)
        found = [np.unique(row, return_inverse=True) for row in flat]
        width = max((own.size for own, _ in found), default=0)
        near, weights = np.empty((len(at), width), int), np.zeros((len(at), offsets.size, width))
        for k, (own, place) in enumerate(found):
            near[k, : own.size], near[k, own.size :] = own, own[0]
            np.put_along_axis(weights[k], place.reshape(offsets.size, -1), values[k], 1)
        pixels = np.unique(near)
        return cls(pixels, np.searchsorted(pixels, near), weights, float(offsets[0]), gain, slope_to_contrast)

    def profiles(self, levels: np.ndarray) -> np.ndarray:
        """The function at all places, (T, M), of the grey levels (P,) of `pixels`."""
        return np.einsum("mtw,mw->tm", self.weights, levels.take(self.near))

    def part(self, some: slice) -> Places:
        """Some of the places, of the same `pixels`."""
        return Places(
            self.pixels, self.near[some], self.weights[some], self.first, self.gain[some], self.slope_to_contrast[some]
        )

    @property
    def gain_of_noise(self) -> np.ndarray:
        """Standard deviation of the function for that of a pixel, (M,)."""
        return np.sqrt((self._middle**2).sum(1))

    def used(self) -> np.ndarray:
        """Which of `pixels` the places depend on, in order, (Q,)."""
        return np.unique(self.near)

    def responses(self, maps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which of `pixels` the places depend on, (Q,), and the derivatives (k, Q) by these of sums ``maps`` (k, M) of
        the offsets that unit contrast would show there."""
        pixels = self.used()
        place = np.searchsorted(pixels, self.near).ravel()
        unit = (self.slope_to_contrast * self.gain)[:, None] * self._middle
        rows = [np.bincount(place, (row[:, None] * unit).ravel(), pixels.size) for row in maps]
        return pixels, np.array(rows)

    @property
    def _middle(self) -> np.ndarray:
        return self.weights[:, self.weights.shape[1] // 2]
