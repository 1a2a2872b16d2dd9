"""The shift and turn at which all expected edges meet an edge of an image. NumPy alone: a recipe has this file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class Aligned:
    """Which poses of a layout are tried, and what tells how well one meets the edges of an image.

    Attributes
    ----------
    pixels : ndarray of int, shape (P, T, k)
        Flat indices of the pixels whose mean is an image's level at T places across each of P pieces of the edges.
    slope : ndarray, shape (T, T)
        Takes the derivative across the edge of such levels.
    candidates : ndarray, shape (C, 3)
        Shifts x, y, px, and turns, rad, the smallest first.
    places : ndarray of int, shape (C, P)
        At which of the T places each piece then is.
    """

    pixels: np.ndarray
    slope: np.ndarray
    candidates: np.ndarray
    places: np.ndarray

    def poses(self, images: np.ndarray) -> np.ndarray:
        """The best candidate in each of n images of P pixels, (n, P): shape (n, 3)."""
        levels = images.take(self.pixels, 1).mean(-1)
        rise = np.abs(levels @ self.slope.T)
        best = [each.take(self._met).sum(0).argmax() for each in rise]
        return self.candidates[np.array(best, int)]

    @cached_property
    def _met(self) -> np.ndarray:
        """Numbers of the places of all pieces at which each candidate then is, (P, C)."""
        return self.places.T + np.arange(len(self.pixels))[:, None] * len(self.slope)
