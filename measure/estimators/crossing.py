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
from typing import NamedTuple

import numpy as np
from scipy import sparse

from imaging.features.locator import MIN_CONTRAST
from imaging.geometry.segments import numbered
from measure.features.lines import fit_lines, trapezoid, trend_along
from measure.features.optics import Optics
from measure.features.points import DECIDED, EachPoint, EdgePoints, UnitNoise
from measure.features.rim_noise import Drawn

STEP = 0.5  # px between the places across the edge
_NEAR = 3  # places on each side within which an edge is brighter on one side, whatever lies beside it
_TRUNCATE = 4  # standard deviations at which the Gaussian ends
_CERTAIN = 4.0  # standard deviations of the function by noise that a point is from being another: it counts as a whole
_DIFFERENCE = 0.01  # standard deviations of the function by noise
_FADES = 2  # steps from the window's ends in which a crossing beside another one counts the less


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

    def locate(self, images: np.ndarray | Drawn) -> EdgePoints:
        """Edge points in a stack of images, shape (n, height, width), or in drawn ones."""
        used = self._used(images)
        profiles = self._profiles_of(used)
        turned = _reversed(profiles)
        profiles *= _polarity(profiles)
        return self._points(profiles, _surest(profiles), turned, self._spread(used))

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
        values = self._by_places(profiles, _bracket(profiles), sign[:, 0])
        return self.locate_each(clean[None]), self._of_places(values, clean.size)

    def _signs(self, profiles: np.ndarray) -> np.ndarray:
        """1 or -1 of each position by itself, (m, n).

        Signs that are known stand in an image unless all of it brightens the other way, between the ends and close to
        the middle: light from elsewhere than the scene says turns all of them round.
        """
        rise = _rise(profiles)
        if self.signs is None:
            return np.where(rise >= 0, 1.0, -1.0)
        known, near = self.signs[:, None], max(profiles.shape[1] // 2 - _NEAR, 0)
        other = ((known * rise).sum(0) < 0) & ((known * _rise(profiles[:, near : profiles.shape[1] - near])).sum(0) < 0)
        return known * np.where(other, -1.0, 1.0)

    def _offsets(self, crossing, start, found, profiles) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Offsets, px, whether they are valid, and the slopes there, all (m, n)."""
        offset, slope = _refine(profiles, crossing, start)
        valid = found & (np.abs(offset - start) < 1)
        return np.where(valid, self.offsets[0] + STEP * offset, 0.0), valid, np.where(valid, -slope / STEP, 0.0)

    def _points(self, profiles: np.ndarray, surest: Crossings, turned: np.ndarray, spread: np.ndarray) -> EdgePoints:
        offset, valid, slope = self._offsets(*surest[:3], profiles)
        along = np.broadcast_to(self.positions, (profiles.shape[2], self.positions.size))
        contrast, trend, _ = trend_along(along, self.slope_to_contrast * slope.T, 1.0 * valid.T)
        even = trapezoid(self.positions)
        weights = even * _counted(surest, spread, self.offsets.size).T
        certain = (weights * valid.T).sum(1) / np.maximum((even * valid.T).sum(1), 1e-300)
        weights[certain < DECIDED] = even
        return EdgePoints(along, offset.T * self.gain, valid.T, contrast, turned, trend, weights, certain=certain)

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
        turned, polarity = _reversed(profiles), _polarity(profiles)
        profiles *= polarity
        spread, surest = self._spread(used), _surest(profiles)
        found = self._points(profiles, surest, turned, spread)
        values = self._by_places(profiles, surest, np.full(len(profiles), polarity[0]))
        if DECIDED <= found.certain[0] < 1:
            values += self._by_weights(found, profiles, spread, float(polarity[0]))
        return found, self._of_places(values, clean.size)

    def _by_weights(self, found: EdgePoints, profiles: np.ndarray, spread: np.ndarray, polarity: float) -> np.ndarray:
        """What a point's weight, as the function changes it, does to the line: as if it moved by so much, (m, T)."""
        spread = np.broadcast_to(spread, (len(profiles), 1))
        counted = _counted(_surest(profiles), spread, self.offsets.size)[:, 0]
        here = np.flatnonzero((counted > 0) & (counted < 1) & found.valid[0])
        line = fit_lines(found, found.weights)
        expected = line.mean_offset + np.tan(line.tilt) * (self.positions[here] - line.mean_along)
        rest = polarity * (found.offset[0, here] - expected) / counted[here]
        values = np.zeros((len(profiles), self.offsets.size))
        values[here] = rest[:, None] * _counted_by(profiles[here, :, 0], spread[here])
        return values

    def _of_places(self, values: np.ndarray, size: int) -> sparse.csr_array:
        """Derivatives by all pixels (m, size) of what has these by the function at all places, (m, T)."""
        rows = sparse.csr_array(values)
        columns = rows.indices + np.repeat(np.arange(len(values)), np.diff(rows.indptr)) * self.offsets.size
        pick = sparse.csr_array((rows.data, columns, rows.indptr), (len(values), self.kernel.shape[0]))
        near = sparse.coo_array(pick @ self.kernel + sparse.diags_array(values.sum(1)) @ self._common)
        return sparse.csr_array((near.data, (near.row, self.pixels[near.col])), (len(values), size))

    def _by_places(self, profiles: np.ndarray, bracket: tuple[np.ndarray, ...], polarity: np.ndarray) -> np.ndarray:
        """d(offset) / d(function) of one image whose profiles (m, T, 1) were made positive by signs (m,), (m, T)."""
        crossing, start = bracket[:2]
        root, slope = _refine(profiles, crossing, start)
        values = np.zeros(profiles.shape[:2])
        values[np.arange(len(values))[:, None], crossing[:, :1] + np.arange(-1, 3)] = (
            -STEP / slope[:, :1] * (polarity * self.gain)[:, None] * _cubic_weights(root - crossing)[:, 0]
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


def _falls(signed: np.ndarray) -> np.ndarray:
    """How much the function falls from each place to the next where it crosses zero there, else 0; (m, T - 3, n)."""
    left, right = signed[:, 1:-2], signed[:, 2:-1]
    return (left - right) * ((left >= 0) & (right < 0))


def _bracket(signed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steepest descent through zero: left index, first estimate (in steps) and whether there is one; shape (m, n)."""
    fall = _falls(signed)
    return _started(signed, fall, fall.argmax(1))


def _started(signed: np.ndarray, fall: np.ndarray, best: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `_bracket` says of a choice (m, n) among the places that have a fall."""
    here = np.take_along_axis(signed[:, 1:-2], best[:, None], 1)[:, 0]
    drop = np.take_along_axis(fall, best[:, None], 1)[:, 0]
    found = drop > 0
    return best + 1, best + 1 + np.where(found, here / np.where(found, drop, 1), 0), found


class Crossings(NamedTuple):
    """What `_bracket` says, and how far each is from being another one, in the function's unit; all (m, n)."""

    crossing: np.ndarray
    start: np.ndarray
    found: np.ndarray
    apart: np.ndarray


def _surest(signed: np.ndarray) -> Crossings:
    """The steepest descent through zero, and how far noise would have to move the function for another one."""
    fall = _falls(signed)
    best, ahead = fall.argmax(1), np.full(fall[:, 0].shape, np.inf)
    several = (fall > 0).sum(1) > 1
    if several.any():
        best[several], ahead[several] = _first_of_several(np.moveaxis(signed, 1, -1)[several])
    crossing, start, found = _started(signed, fall, best)
    return Crossings(crossing, start, found, np.minimum(ahead, _clear(signed, crossing)))


def _counted(found: Crossings, spread: np.ndarray, size: int) -> np.ndarray:
    """How much a point counts by how far it is from being another one, 0 to 1, (m, n).

    ``spread`` is the standard deviation of the function, ``size`` the number of its places; one that leaves the window
    counts the less, too.
    """
    whole = np.maximum(_CERTAIN * spread, np.finfo(np.float32).tiny)
    part = np.minimum(found.apart, whole) / whole * _inside(found.start - 1, size - 3)
    return part**2 * (3 - 2 * part)  # smooth at both ends, so that its derivative tells what noise does


def _counted_by(rows: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Derivative of `_counted` by the values of functions (k, T), by central differences, (k, T)."""
    step = _DIFFERENCE * spread[..., None] * np.eye(rows.shape[1])
    above, below = (
        _counted(_surest(np.moveaxis(rows[:, None] + sign * step, 1, -1)), spread, rows.shape[1]) for sign in (1, -1)
    )
    return (above - below) / (2 * _DIFFERENCE * spread)


def _inside(place: np.ndarray, last: int) -> np.ndarray:
    """1, falling to 0 from `_FADES` steps before the ends 0 and ``last`` of places where there may be a crossing.

    From nearer in a small window, for in its middle nothing counts less.
    """
    return np.clip(np.minimum(place, last - place) / min(_FADES, last / 4), 0.0, 1.0)


def _first_of_several(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of functions (k, T) with several crossings the steepest, and how much it is ahead of the next, (k,).

    Slopes are central differences, interpolated to the crossing: they change little where noise moves it over a place.
    Towards the window's ends they count the less, so that one that comes into it takes over smoothly.
    """
    left, fall = rows[:, 1:-2], _falls(rows)
    part = np.where(fall > 0, left / np.where(fall > 0, fall, 1.0), 0.0)
    slope = (rows[:, :-2] - rows[:, 2:]) / 2
    place = np.arange(left.shape[1]) + part
    steep = ((1 - part) * slope[:, :-1] + part * slope[:, 1:]) * _inside(place, left.shape[1])
    steep = np.where(fall > 0, steep, -np.inf)
    best = np.partition(steep, -2, 1)[:, -2:]
    return steep.argmax(1), best[:, 1] - best[:, 0]


def _clear(signed: np.ndarray, crossing: np.ndarray) -> np.ndarray:
    """How far from zero the function is within a px beside the crossing, on the side where it is less, (m, n).

    Where it hardly leaves zero, another crossing is about to take this one away, or did so.
    """
    before, here, after, beyond = (np.take_along_axis(signed, crossing[:, None] + k, 1)[:, 0] for k in (-1, 0, 1, 2))
    return np.maximum(np.minimum(np.maximum(before, here), -np.minimum(after, beyond)), 0.0)


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
