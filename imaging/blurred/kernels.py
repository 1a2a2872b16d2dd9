"""Kernels of a Gaussian blur and square pixels around the nodes of an arrangement, and their sums at the pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array
from scipy.special import ndtr

from imaging.geometry.segments import numbered

REACH = 5.0  # standard deviations of the blur at which a kernel ends: 3e-7 of a step is cut off
_PIXEL = 1.001  # px: half a pixel, a node's distance from its own, and a little, lest 0.6 px are where a window grows


@dataclass(frozen=True, eq=False)
class Kernels:
    """k(u) = Phi((u + 1/2) / s) - Phi((u - 1/2) / s) of each node on its window of w x w pixels, and where that lies.

    Attributes
    ----------
    x, y : ndarray, shape (n, w)
        k at the columns and rows of the window.
    column, row : ndarray of int32, shape (n,)
        The window's first pixel.
    place : ndarray, shape (n, 2)
        The nodes, recorded px.
    blur : ndarray, shape (n,)
        s, px.
    """

    x: np.ndarray
    y: np.ndarray
    column: np.ndarray
    row: np.ndarray
    place: np.ndarray
    blur: np.ndarray

    @classmethod
    def around(cls, place: np.ndarray, blur: np.ndarray, least: float) -> Kernels:
        """Of nodes (n, 2) with blurs (n,), px; windows are wide enough for a blur of ``least``."""
        reach = int(REACH * float(blur.max(initial=least)) + _PIXEL)
        place = np.nan_to_num(place, nan=-1e6, posinf=1e6, neginf=-1e6)
        first = np.rint(np.clip(place, -1e6, 1e6)).astype(np.int32) - np.int32(reach)
        kernels = []
        for axis in (0, 1):
            u = place[:, axis, None] - first[:, axis, None] - np.arange(2 * reach + 2) + 0.5
            edges = ndtr(u / blur[:, None])
            kernels.append(edges[:, :-1] - edges[:, 1:])
        return cls(kernels[0], kernels[1], first[:, 0], first[:, 1], place, blur)

    def derivative(self, axis: int, order: int) -> np.ndarray:
        """Derivative of k by the node's x (axis 0) or y (axis 1), order 1 to 3, shape (n, w)."""
        first = self.row if axis else self.column
        s = self.blur[:, None]
        u = (self.place[:, axis, None] - first[:, None] + 0.5 - np.arange(self.x.shape[1] + 1)) / s
        hermite = (1.0, -u, u * u - 1)[order - 1]
        density = hermite * np.exp(-u * u / 2) / np.sqrt(2 * np.pi)
        return (density[:, :-1] - density[:, 1:]) / s**order

    def product(self) -> np.ndarray:
        """k(x) k(y), (n, w, w): rows by columns."""
        return self.y[:, :, None] * self.x[:, None, :]


@dataclass(frozen=True, eq=False)
class Scatter:
    """Adds values on the nodes' windows up at the pixels.

    Attributes
    ----------
    slot : ndarray of int32, shape (n, h, w)
        Pixel of each place of each node's window; ``size`` for none.
    piece : ndarray of int, shape (n,)
        Whose piece the node is.
    pieces, size : int
        Number of pieces and of pixels.
    """

    slot: np.ndarray
    piece: np.ndarray
    pieces: int
    size: int

    def of_nodes(self, which: slice) -> tuple[np.ndarray, Scatter]:
        """Of some nodes alone: the pixels that they reach, (p,), and the sums at these, all as of one piece."""
        slot = self.slot[which]
        used, place = numbered(self.size + 1, slot)
        pixels = used[used < self.size]  # that there is none comes last, so its number stays theirs
        return pixels, Scatter(place.take(slot), np.zeros(len(slot), int), 1, pixels.size)

    def at_all(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Sum of values (n, h, w) times the nodes' weights, (n,) or c of them (n, c); (P,) or (P, c)."""
        return self._summed(self.slot, values, weights, self.size + 1)[:-1]

    def by_piece(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Sums of values (n, h, w) times the nodes' weights (n, c) for each piece, (c, pieces, P)."""
        index = self.slot + (self.piece * (self.size + 1)).astype(np.int32)[:, None, None]
        found = self._summed(index, values, weights, self.pieces * (self.size + 1))
        return found.T.reshape(-1, self.pieces, self.size + 1)[:, :, :-1]

    def _summed(self, index: np.ndarray, values: np.ndarray, weights: np.ndarray, size: int) -> np.ndarray:
        """A sparse matrix, a column a node, times the weights: (size,) or (size, c)."""
        ends = np.arange(len(values) + 1, dtype=np.int32) * np.int32(values[:1].size)
        return csc_array((values.ravel(), index.ravel(), ends), (size, len(values))) @ weights
