"""Edge points where a linear function of the image changes sign across an edge.

The function at a fixed place is linear in the image, so all places of all positions are one sparse matrix, applied to a
whole stack of images at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from imaging.features.locator import MIN_CONTRAST
from imaging.geometry.segments import numbered
from measure.features.lines import trapezoid, trend_along
from measure.features.points import EachPoint, EdgePoints, UnitNoise

STEP = 0.5  # px between the places across the edge
_NEAR = 3  # places on each side within which an edge is brighter on one side, whatever lies beside it
_TRUNCATE = 4  # standard deviations at which the Gaussian ends


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

    def locate(self, images: np.ndarray) -> EdgePoints:
        """Edge points in a stack of images, shape (n, height, width)."""
        profiles = self._profiles(images)
        turned = _reversed(profiles)
        profiles *= _polarity(profiles)
        return self._points(*_bracket(profiles), profiles, turned)

    def locate_each(self, images: np.ndarray) -> EachPoint:
        """Edge points of images (n, height, width), each position by itself: its contrast may be of either sign."""
        return self.locate_each_in(images.reshape(len(images), -1)[:, self.pixels])

    def locate_each_in(self, used: np.ndarray) -> EachPoint:
        """The same of images of which only the locator's `pixels` are given, (n, P)."""
        profiles = self._profiles_of(np.ascontiguousarray(used.T))
        profiles *= self._signs(profiles)[:, None]
        offset, valid, slope = self._offsets(*_bracket(profiles), profiles)
        return EachPoint(offset.T * self.gain, valid.T, (self.slope_to_contrast[:, None] * slope).T)

    def respond_each(self, clean: np.ndarray) -> tuple[EachPoint, sparse.csr_array]:
        """Such points of one noise-free image and d(offset) / d(pixel), shape (m, height * width)."""
        profiles = self._profiles(clean[None])
        sign = self._signs(profiles)
        profiles *= sign[:, None]
        return self.locate_each(clean[None]), self._response(profiles, sign[:, 0], clean.size)

    def _signs(self, profiles: np.ndarray) -> np.ndarray:
        """1 or -1 of each position by itself, (m, n).

        Signs that are known stand in an image unless all of it brightens the other way, between the ends and close to
        the middle: light from elsewhere than the scene says turns all of them round.
        """
        rise = _rise(profiles)
        if self.signs is None:
            return np.where(rise >= 0, 1.0, -1.0)
        known, near = self.signs[:, None], profiles.shape[1] // 2 - _NEAR
        other = ((known * rise).sum(0) < 0) & ((known * _rise(profiles[:, near:-near])).sum(0) < 0)
        return known * np.where(other, -1.0, 1.0)

    def _offsets(self, crossing, start, found, profiles) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Offsets, px, whether they are valid, and the slopes there, all (m, n)."""
        offset, slope = _refine(profiles, crossing, start)
        valid = found & (np.abs(offset - start) < 1)
        return np.where(valid, self.offsets[0] + STEP * offset, 0.0), valid, np.where(valid, -slope / STEP, 0.0)

    def _points(self, crossing, start, found, profiles: np.ndarray, turned: np.ndarray) -> EdgePoints:
        offset, valid, slope = self._offsets(crossing, start, found, profiles)
        along = np.broadcast_to(self.positions, (profiles.shape[2], self.positions.size))
        contrast, trend, _ = trend_along(along, self.slope_to_contrast * slope.T, 1.0 * valid.T)
        return EdgePoints(along, offset.T * self.gain, valid.T, contrast, turned, trend, trapezoid(self.positions))

    def unit_noise(self) -> UnitNoise:
        """Response to noise on a straight edge of unit contrast: the function's over its slope."""
        return UnitNoise(self.positions, trapezoid(self.positions), self.unit_response())

    def unit_response(self) -> sparse.csr_array:
        """Derivative of the offsets by `pixels` at unit contrast, px per grey level, (m, P)."""
        middle = self.kernel[self.offsets.size // 2 :: self.offsets.size] + self._common
        return sparse.csr_array(sparse.diags_array(self.slope_to_contrast * self.gain) @ middle)

    def linear_response(self, clean: np.ndarray) -> tuple[EdgePoints, sparse.csr_array]:
        """Edge points of one noise-free image and d(offset) / d(pixel), shape (m, height * width)."""
        profiles = self._profiles(clean[None])
        turned, polarity = _reversed(profiles), _polarity(profiles)
        profiles *= polarity
        found = self._points(*_bracket(profiles), profiles, turned)
        return found, self._response(profiles, np.full(len(profiles), polarity[0]), clean.size)

    def _response(self, profiles: np.ndarray, polarity: np.ndarray, size: int) -> sparse.csr_array:
        """d(offset) / d(pixel) of one image whose profiles (m, T, 1) were made positive by signs (m,)."""
        crossing, start, _ = _bracket(profiles)
        root, slope = _refine(profiles, crossing, start)
        weights = _cubic_weights(root - crossing)
        rows = np.arange(crossing.shape[0])[:, None]
        columns = rows * self.offsets.size + crossing[:, :1] + np.arange(-1, 3)
        scale = -STEP / slope[:, :1] * (polarity * self.gain)[:, None]
        values = scale * weights[:, 0]
        pick = sparse.csr_array(
            (values.ravel(), (np.repeat(rows, 4), columns.ravel())), (rows.size, self.kernel.shape[0])
        )
        near = sparse.coo_array(pick @ self.kernel + sparse.diags_array(scale[:, 0]) @ self._common)
        return sparse.csr_array((near.data, (near.row, self.pixels[near.col])), (rows.size, size))

    def _profiles(self, images: np.ndarray) -> np.ndarray:
        """The function at all places, shape (m, T, n)."""
        return self._profiles_of(np.ascontiguousarray(images.reshape(len(images), -1)[:, self.pixels].T))

    def _profiles_of(self, used: np.ndarray) -> np.ndarray:
        """The same of the grey levels (P, n) of its pixels."""
        profiles = (self.kernel @ used).reshape(self.positions.size, self.offsets.size, used.shape[1])
        if len(self.level):
            profiles += (self.basis @ (self.level @ used))[:, None]
        return profiles

    @property
    def _common(self) -> sparse.csr_array:
        return sparse.csr_array(self.basis) @ sparse.csr_array(self.level)


def places_across(places: np.ndarray, normals: np.ndarray, window: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Offsets (T,) within the window, px, and the places (m T, 2) at them from ``places`` with their normals."""
    half = int(np.ceil(window / STEP))
    offsets = STEP * np.arange(-half, half + 1)
    across = (places[:, None] + offsets[:, None] * normals[:, None]).reshape(-1, 2)
    return offsets, across, np.repeat(normals, offsets.size, 0)


def gaussian_rows(places: np.ndarray, scale: float, shape: tuple[int, int], weigh=None) -> sparse.csr_array:
    """Rows that smooth an image at places (M, 2), px, by a sampled Gaussian whose sum is exactly 1.

    ``weigh(gauss, dx, dy)``, arrays (M, k, k), makes other kernels of the Gaussian and the pixels' distances, px.
    """
    radius = int(np.ceil(_TRUNCATE * scale))
    nearest = np.rint(places).astype(np.int32)
    grid = np.arange(-radius, radius + 1, dtype=np.int32)
    dx = (nearest - places)[:, 0, None, None] + grid
    dy = (nearest - places)[:, 1, None, None] + grid[:, None]
    gauss = np.exp(-(dx**2) / (2 * scale**2)) / (2 * np.pi * scale**2) * np.exp(-(dy**2) / (2 * scale**2))
    values = gauss / gauss.sum((1, 2), keepdims=True) if weigh is None else weigh(gauss, dx, dy)
    columns = (nearest[:, 1, None, None] + grid[:, None]) * shape[1] + nearest[:, 0, None, None] + grid
    starts = np.arange(len(places) + 1) * grid.size**2
    return sparse.csr_array((values.ravel(), columns.ravel(), starts), (len(places), shape[0] * shape[1]))


def reached(kernel: sparse.csr_array, *others: np.ndarray) -> tuple[np.ndarray, sparse.csr_array]:
    """The pixels (P,) that rows (m, H W) and flat indices reach, in order, and the rows at these alone, (m, P)."""
    pixels, place = numbered(kernel.shape[1], kernel.indices, *others)
    return pixels, sparse.csr_array((kernel.data, place[kernel.indices], kernel.indptr), (kernel.shape[0], pixels.size))


def _polarity(profiles: np.ndarray) -> np.ndarray:
    """+1 where the image brightens along the normal, else -1; one sign an image, shape (n,)."""
    return np.where(_rise(profiles).sum(0) >= 0, 1.0, -1.0)


def _rise(profiles: np.ndarray) -> np.ndarray:
    """How much the image brightens along the normal at each position, (m, n)."""
    half = profiles.shape[1] // 2
    return profiles[:, :half].sum(1) - profiles[:, half + 1 :].sum(1)


def _reversed(profiles: np.ndarray) -> np.ndarray:
    """Whether the two halves of the edge brighten in opposite directions, each as clearly as the other, (n,)."""
    rise = _rise(profiles)
    first, second = (part.mean(0) for part in np.array_split(rise, 2))
    noise = np.abs(np.diff(rise, axis=0)).mean(0)
    return (first * second < 0) & (np.minimum(np.abs(first), np.abs(second)) > 2 * noise)


def _bracket(signed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steepest descent through zero: left index, first estimate (in steps) and whether there is one; shape (m, n)."""
    left, right = signed[:, 1:-2], signed[:, 2:-1]
    fall = (left - right) * ((left >= 0) & (right < 0))
    best = fall.argmax(1)
    here = np.take_along_axis(left, best[:, None], 1)[:, 0]
    drop = np.take_along_axis(fall, best[:, None], 1)[:, 0]
    found = drop > 0
    return best + 1, best + 1 + np.where(found, here / np.where(found, drop, 1), 0), found


def _refine(signed: np.ndarray, crossing: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root (in steps) of the cubic through the four values around the crossing, and its slope there; shape (m, n)."""
    values = np.stack([np.take_along_axis(signed, crossing[:, None] + k, 1)[:, 0] for k in (-1, 0, 1, 2)])
    c0 = values[1]
    c1 = -values[0] / 3 - values[1] / 2 + values[2] - values[3] / 6
    c2 = (values[0] + values[2]) / 2 - values[1]
    c3 = (values[3] - values[0]) / 6 + (values[1] - values[2]) / 2
    x = start - crossing
    for _ in range(3):
        slope = c1 + x * (2 * c2 + 3 * x * c3)
        x = x - (c0 + x * (c1 + x * (c2 + x * c3))) / np.where(slope < 0, slope, -np.inf)
    return crossing + x, c1 + x * (2 * c2 + 3 * x * c3)


def _cubic_weights(x: np.ndarray) -> np.ndarray:
    """Weights of the values at -1, 0, 1, 2 in the cubic's value at x, shape (m, n, 4) for x (m, n)."""
    return np.stack(
        [
            -x * (x - 1) * (x - 2) / 6,
            (x + 1) * (x - 1) * (x - 2) / 2,
            -(x + 1) * x * (x - 2) / 2,
            (x + 1) * x * (x - 1) / 6,
        ],
        -1,
    )
