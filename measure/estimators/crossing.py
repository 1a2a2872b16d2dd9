"""Edge points where a linear function of the image changes sign across an edge.

The function at a fixed place is linear in the image, so all places of all positions are one sparse matrix, applied to a
whole stack of images at once.

Where two edges run together, of a face and of a shadow on it, the function falls through zero more than once, or nearly
so, and noise may decide which edge is found. A point counts the less the nearer it is to that, and not at all where it
would jump: a line through points is then a smooth function of the image.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from imaging.features.locator import MIN_CONTRAST
from imaging.geometry.segments import numbered
from measure.estimators import crossings
from measure.estimators.crossings import STEP, Crossings
from measure.estimators.windows import gaussian_windows
from measure.features.lines import fit_lines, trapezoid
from measure.features.optics import Optics
from measure.features.points import DECIDED, EachPoint, EdgePoints, UnitNoise
from measure.features.rim_noise import Drawn

_WHOLE = 0.9  # of what a point would count, above which it is certain


@dataclass(frozen=True, eq=False)
class CrossingLocator:
    """Zero-crossing locator for one edge, straight or curved.

    The function is positive on the darker side of an edge that brightens along the normal, and falls through zero.

    Attributes
    ----------
    positions : ndarray, shape (m,)
        Places along the edge, px (or any other parameter of a curve).
    offsets : ndarray, shape (T,)
        Places across the edge, px.
    pixels : ndarray of int
        Flat indices of the pixels that matter.
    kernel : csr_array, shape (m * T, len(pixels))
        The function at each position and place, less what all places of a position have in common.
    slope_to_contrast : ndarray, shape (m,)
        Contrast of a straight blurred edge at which the function has slope 1 at the crossing.
    gain : ndarray, shape (m,)
        Ideal px across the edge for a recorded px.
    basis, level : ndarray, shapes (m, k) and (k, len(pixels))
        Their product is what all places of a position have in common; k may be 0.
    signs : ndarray, shape (m,), or None
        Of positions by themselves: 1 where the image is known to brighten along the normal, -1 where it darkens; None
        where the image has to tell, which it does not where another edge stands just past the places across.
    least_contrast : float
        Contrast / noise below which an edge point's error is no longer linear in the noise.
    optics : Optics, optional
        Whose noise may decide between two crossings; every point counts as a whole where not given.
    places, normals : ndarray, shape (m, 2), optional
        Where the positions are recorded, px, and unit normals there, where the kernel follows from them.
    """

    positions: np.ndarray
    offsets: np.ndarray
    pixels: np.ndarray
    kernel: sparse.csr_array
    slope_to_contrast: np.ndarray
    gain: np.ndarray
    basis: np.ndarray
    level: np.ndarray
    signs: np.ndarray | None = None
    least_contrast: float = MIN_CONTRAST
    optics: Optics | None = None
    places: np.ndarray | None = None
    normals: np.ndarray | None = None

    def locate(self, images: np.ndarray | Drawn) -> EdgePoints:
        """Edge points in a stack of images, shape (n, height, width), or in drawn ones."""
        used = self._used(images)
        profiles = self._profiles_of(used)
        turned = crossings.is_reversed(profiles)
        profiles *= crossings.polarity(profiles)
        return self._points(crossings.surest(profiles), turned, self._spread(used))

    def locate_each(self, images: np.ndarray) -> EachPoint:
        """Edge points of images (n, height, width), each position by itself: its contrast may be of either sign."""
        return self.locate_each_in(images.reshape(len(images), -1)[:, self.pixels])

    def locate_each_in(self, used: np.ndarray) -> EachPoint:
        """The same of images of which only the locator's `pixels` are given, (n, P)."""
        profiles = self._profiles_of(np.ascontiguousarray(used.T))
        profiles *= crossings.known_signs(profiles, self.signs)[:, None]
        offset, valid, slope = self._offsets(crossings.bracket(profiles))
        return EachPoint(offset.T * self.gain, valid.T, (self.slope_to_contrast[:, None] * slope).T)

    def respond_each(self, clean: np.ndarray) -> tuple[EachPoint, sparse.csr_array]:
        """Such points of one noise-free image and d(offset) / d(pixel), shape (m, height * width)."""
        profiles = self._profiles(clean[None])
        sign = crossings.known_signs(profiles, self.signs)
        profiles *= sign[:, None]
        values = self._by_places(crossings.bracket(profiles), sign[:, 0])
        return self.locate_each(clean[None]), self._of_places(values, clean.size)

    def _offsets(self, best: Crossings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Offsets, px, whether they are valid, and the slopes there, all (m, n)."""
        return crossings.located(self.offsets[0], best)

    def _points(self, best: Crossings, turned: np.ndarray, spread: np.ndarray) -> EdgePoints:
        offset, valid, slope = self._offsets(best)
        along = np.broadcast_to(self.positions, offset.T.shape)
        counts = crossings.counted(best, spread, self.offsets.size).T
        contrast = self.slope_to_contrast * slope.T
        return crossings.edge_points(
            along, offset.T * self.gain, valid.T, contrast, trapezoid(self.positions), counts, turned
        )

    def may_jump(self, points: EdgePoints, clean: np.ndarray) -> bool:
        """Whether noise may decide which of two edges points of a noise-free image are on."""
        return bool((points.valid & (points.weights < _WHOLE * trapezoid(self.positions))).any())

    def unit_noise(self) -> UnitNoise:
        """Response to noise on a straight edge of unit contrast: the function's over its slope."""
        return UnitNoise(self.positions, trapezoid(self.positions), self.unit_response())

    def unit_response(self) -> sparse.csr_array:
        """Derivative of the offsets by `pixels` at unit contrast, px per grey level, (m, P)."""
        middle = self.kernel[self.offsets.size // 2 :: self.offsets.size] + self._common
        return sparse.csr_array(sparse.diags_array(self.slope_to_contrast * self.gain) @ middle)

    def linear_response(self, clean: np.ndarray) -> tuple[EdgePoints, sparse.csr_array]:
        """Edge points of one noise-free image and d(offset) / d(pixel), shape (m, height * width)."""
        used = self._used(clean[None])
        profiles = self._profiles_of(used)
        turned, polarity = crossings.is_reversed(profiles), crossings.polarity(profiles)
        profiles *= polarity
        spread, best = self._spread(used), crossings.surest(profiles)
        found = self._points(best, turned, spread)
        values = self._by_places(best, np.full(len(profiles), polarity[0]))
        if DECIDED <= found.certain[0] < 1:
            values += self._by_weights(found, profiles, spread, float(polarity[0]))
        return found, self._of_places(values, clean.size)

    def _by_weights(self, found: EdgePoints, profiles: np.ndarray, spread: np.ndarray, polarity: float) -> np.ndarray:
        """What a point's weight, as the function changes it, does to the line: as if it moved by so much, (m, T)."""
        spread = np.broadcast_to(spread, (len(profiles), 1))
        counted = crossings.counted(crossings.surest(profiles), spread, self.offsets.size)[:, 0]
        here = np.flatnonzero((counted > 0) & (counted < 1) & found.valid[0])
        line = fit_lines(found, found.weights)
        expected = line.mean_offset + np.tan(line.tilt) * (self.positions[here] - line.mean_along)
        rest = polarity * (found.offset[0, here] - expected) / counted[here]
        values = np.zeros((len(profiles), self.offsets.size))
        values[here] = rest[:, None] * crossings.counted_by(profiles[here, :, 0], spread[here])
        return values

    def _of_places(self, values: np.ndarray, size: int) -> sparse.csr_array:
        """Derivatives by all pixels (m, size) of what has these by the function at all places, (m, T)."""
        rows = sparse.csr_array(values)
        columns = rows.indices + np.repeat(np.arange(len(values)), np.diff(rows.indptr)) * self.offsets.size
        pick = sparse.csr_array((rows.data, columns, rows.indptr), (len(values), self.kernel.shape[0]))
        near = sparse.coo_array(pick @ self.kernel + sparse.diags_array(values.sum(1)) @ self._common)
        return sparse.csr_array((near.data, (near.row, self.pixels[near.col])), (len(values), size))

    def _by_places(self, best: Crossings, polarity: np.ndarray) -> np.ndarray:
        """d(offset) / d(function) of one image whose profiles were made positive by signs (m,), (m, T)."""
        root, slope = crossings.refine(best)
        values = np.zeros((len(root), self.offsets.size))
        values[np.arange(len(values))[:, None], best.crossing[:, :1] + np.arange(-1, 3)] = (
            -STEP / slope[:, :1] * (polarity * self.gain)[:, None] * crossings.cubic_weights(root - best.crossing)[:, 0]
        )
        return values

    def _used(self, images: np.ndarray | Drawn) -> np.ndarray:
        """Grey levels of its pixels, (P, n)."""
        if isinstance(images, Drawn):
            return np.ascontiguousarray(images.at(self.pixels).T)
        return np.ascontiguousarray(images.reshape(len(images), -1)[:, self.pixels].T)

    def _profiles(self, images: np.ndarray) -> np.ndarray:
        """The function at all places, shape (m, T, n)."""
        return self._profiles_of(self._used(images))

    def _spread(self, used: np.ndarray) -> np.ndarray:
        """Standard deviation of the function by noise at each position, (m, n) or (m, 1), of its pixels (P, n)."""
        if self.optics is None:
            return np.zeros((len(self.positions), 1))
        variance = self.optics.noise_at(used.mean(0))
        return self._gain_of_noise[:, None] * np.sqrt(self.optics.noise_variance if variance is None else variance)

    @cached_property
    def _gain_of_noise(self) -> np.ndarray:
        """Standard deviation of the function, less what is common, for that of a pixel, (m,)."""
        squares = np.add.reduceat(self.kernel.data**2, self.kernel.indptr[:-1])
        return np.sqrt(squares[self.offsets.size // 2 :: self.offsets.size])

    def _profiles_of(self, used: np.ndarray) -> np.ndarray:
        """The same of the grey levels (P, n) of its pixels."""
        profiles = (self.kernel @ used).reshape(self.positions.size, self.offsets.size, used.shape[1])
        if len(self.level):
            profiles += (self.basis @ (self.level @ used))[:, None]
        return profiles

    @property
    def _common(self) -> sparse.csr_array:
        return sparse.csr_array(self.basis) @ sparse.csr_array(self.level)


def gaussian_rows(places: np.ndarray, scale: float, shape: tuple[int, int], weigh=None) -> sparse.csr_array:
    """Rows that smooth an image at places (M, 2), px, as `windows.gaussian_windows` does, (M, height * width)."""
    return in_rows(*gaussian_windows(places, scale, weigh), shape)


def in_rows(values: np.ndarray, first: np.ndarray, shape: tuple[int, int]) -> sparse.csr_array:
    """Windows (M, k, k) whose first pixels are (x, y), (M, 2), as rows of the whole image, (M, height * width)."""
    grid = np.arange(values.shape[1], dtype=np.int32)
    columns = (first[:, 1, None, None] + grid[:, None]) * shape[1] + first[:, 0, None, None] + grid
    starts = np.arange(len(values) + 1) * grid.size**2
    return sparse.csr_array((values.ravel(), columns.ravel(), starts), (len(values), shape[0] * shape[1]))


def reached(kernel: sparse.csr_array, *others: np.ndarray) -> tuple[np.ndarray, sparse.csr_array]:
    """The pixels (P,) that rows (m, H W) and flat indices reach, in order, and the rows at these alone, (m, P)."""
    pixels, place = numbered(kernel.shape[1], kernel.indices, *others)
    return pixels, sparse.csr_array((kernel.data, place[kernel.indices], kernel.indptr), (kernel.shape[0], pixels.size))
