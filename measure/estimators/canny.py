"""The classic pipeline: gradient threshold and Canny's thinning, then each edge pixel refined.

The refined point is where the gradient across the edge is largest: it does not depend on which of the pixels beside the
edge noise lets Canny keep, and neither does its error, which therefore is linear in the noise as a whole.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import sparse
from scipy.ndimage import binary_dilation
from scipy.special import ndtr

from imaging.features.locator import MIN_CONTRAST, edge_blur
from measure.estimators.coverage import NODE_WEIGHTS, NODES, half_plane
from measure.estimators.kinds import EstimatorKind
from measure.estimators.profile import TRUNCATE, profile_kernel, top, top_kernel
from measure.estimators.separate import SeparateEstimator, by_points, calipers_for, measurable
from measure.estimators.thinning import Thinned, Thinning
from measure.features.calipers import Caliper
from measure.features.layout import Layout
from measure.features.lines import cells, fit_lines, trend_along
from measure.features.optics import Optics
from measure.features.points import EdgePoints, UnitNoise
from measure.features.rim_noise import Drawn

_BESIDE = 0.7  # of the gradient at its top is left at a pixel half a diagonal away, at least
_LOST = 0.1  # of an edge's points; up to there the variance is off by 3 % at most
_ASIDE, _BY_NOISE = 1.5, 4.0  # px from the line, and standard deviations of the gradient: there noise may make a point


@dataclass(frozen=True, eq=False)
class CannyLocator:
    """Edge pixels near one expected edge.

    Attributes
    ----------
    caliper : Caliper
    optics : Optics
    threshold : float
        Smallest gradient of an edge point, grey levels a pixel.
    thinning : Thinning
        What chooses the edge pixels, in a window of the image.
    near : ndarray of int, shape (m, 2)
        Row and column in that window of the pixels within the search window and away from the corners, in order along
        the edge.
    along, offset, gain : ndarray, shape (m,)
        Where they are in the edge's caliper, ideal px, and the ideal px across it for a recorded px.
    kernel : ndarray, shape (k * k, 8)
        What k x k pixels tell of the gradient across the edge (`profile_kernel`).
    least_contrast : float
        Contrast / noise below which an edge point's error is no longer linear in the noise.
    """

    caliper: Caliper
    optics: Optics
    threshold: float
    thinning: Thinning
    near: np.ndarray
    along: np.ndarray
    offset: np.ndarray
    gain: np.ndarray
    kernel: np.ndarray
    least_contrast: float = MIN_CONTRAST

    @classmethod
    def of(cls, optics: Optics, caliper: Caliper, threshold: float, thinning: Thinning) -> CannyLocator:
        """Prepare the locator of one edge."""
        y, x = np.divmod(near_pixels(optics, caliper), optics.shape[1])
        ideal = optics.ideal(np.stack([x, y], -1).astype(float))
        along, offset = caliper.coordinates(ideal)
        gain = np.linalg.norm(optics.gradient(ideal, caliper.normal), axis=-1)
        order = np.argsort(along, kind="stable")
        near = np.stack([y - thinning.rows.start, x - thinning.columns.start], -1)[order]
        kernel = profile_kernel(optics.scale_px, caliper.normal)
        return cls(caliper, optics, threshold, thinning, near, along[order], offset[order], gain[order], kernel)

    def locate(self, images: np.ndarray | Thinned | Drawn) -> EdgePoints:
        """Edge points in a stack of images, shape (n, height, width), in its thinned window, or in drawn ones."""
        if isinstance(images, Drawn):
            return self._alone.locate(self._alone.thinning.of_drawn(images, self.optics.shape))
        seen = self.thinning(images) if isinstance(images, np.ndarray) else images
        which, pixel = self._kept(seen)
        shift, gradient, curvature, good = top(self._profiles(seen, which, pixel))
        good &= np.abs(gradient) >= self.threshold
        counts = np.bincount(which, minlength=len(seen.parts))
        slot = np.arange(which.size) - np.repeat(np.cumsum(counts) - counts, counts)
        size = len(counts), max(counts.max(), 1)
        along, offset, valid, steep = np.zeros(size), np.zeros(size), np.zeros(size, bool), np.zeros((2, *size))
        along[which, slot], offset[which, slot] = self.along[pixel], self.offset[pixel] + shift * self.gain[pixel]
        valid[which, slot], steep[0, which, slot] = good, gradient
        steep[1, which, slot] = np.where(good, self._curvature_to_contrast * curvature, 0.0)
        weights = cells(along, valid, self._limits)
        late = along > self.caliper.positions.mean()
        first, second = ((steep[0] * valid * half).sum(1) for half in (~late, late))
        (_, contrast), (rise, trend), (start, _) = trend_along(along, np.abs(steep), weights)
        sure = self._sure(start, rise) & (weights.sum(1) > (1 - _LOST) * np.diff(self._limits))
        return EdgePoints(along, offset, valid, contrast, first * second < 0, trend, weights, sure)

    def may_jump(self, points: EdgePoints, clean: np.ndarray) -> bool:
        """Whether noise may give or take points that lie beside the line through those of a noise-free image."""
        thinning, line = self._alone.thinning, fit_lines(points, points.weights)
        noise = _gradient_noise(self.optics, self.kernel)
        kept = replace(thinning, threshold=max(thinning.threshold - _BY_NOISE * noise, noise))(clean[None])
        row, column = np.nonzero(kept.kept[0])
        seen = np.stack([column + thinning.columns.start, row + thinning.rows.start], -1)
        along, offset = self.caliper.coordinates(self.optics.ideal(seen.astype(float)))
        beside = np.zeros(kept.kept.shape[1:], bool)
        aside = np.abs(offset - line.mean_offset - np.tan(line.tilt) * (along - line.mean_along)) > _ASIDE
        beside[row[aside], column[aside]] = True
        return bool(binary_dilation(beside, np.ones((3, 3)))[tuple(self._alone.near.T)].any())

    @cached_property
    def _alone(self) -> CannyLocator:
        """The same in the window of this edge."""
        (thinning,) = thinnings(self.optics, [self.caliper], self.threshold)
        return CannyLocator.of(self.optics, self.caliper, self.threshold, thinning)

    def edge_pixels(self, image: np.ndarray) -> np.ndarray:
        """Row and column of the pixels that the edge points of one image are refined from, int, shape (k, 2)."""
        _, pixel = self._kept(self.thinning(image[None]))
        return self.near[pixel] + [self.thinning.rows.start, self.thinning.columns.start]

    @cached_property
    def pixels(self) -> np.ndarray:
        """Flat indices of the pixels that can change the result."""
        used = np.zeros(self.optics.shape, bool)
        view = used[self.thinning.rows, self.thinning.columns]
        reach = max(self._radius, self.thinning.reach)
        steps = np.arange(-reach, reach + 1)
        for step in steps:
            view[self.near[:, :1] + step, self.near[:, 1:] + steps] = True
        return np.flatnonzero(used)

    def unit_noise(self) -> UnitNoise:
        """Response to noise on a straight edge of unit contrast at the expected place."""
        points, response = self.linear_response(self._straight_edge())
        keep = points.valid[0, : response.shape[0]]
        used = np.flatnonzero(keep)
        return UnitNoise(points.along[0, used], points.weights[0, used], self._step * response[used][:, self.pixels])

    def linear_response(self, clean: np.ndarray) -> tuple[EdgePoints, sparse.csr_array]:
        """Edge points of one noise-free image and d(offset) / d(pixel), shape (m, height * width)."""
        seen = self.thinning(clean[None])
        which, pixel = self._kept(seen)
        shift, _, curvature, _ = top(self._profiles(seen, which, pixel))
        steps = np.arange(-self._radius, self._radius + 1)
        middle = (self.near[pixel] + [self.thinning.rows.start, self.thinning.columns.start]) @ [clean.shape[1], 1]
        columns = middle[:, None] + (steps[:, None] * clean.shape[1] + steps).ravel()
        starts = np.arange(pixel.size + 1) * steps.size**2
        values = -top_kernel(self.kernel, shift) * (self.gain[pixel] / curvature)[:, None]
        return self.locate(seen), sparse.csr_array((values.ravel(), columns.ravel(), starts), (pixel.size, clean.size))

    def _kept(self, seen: Thinned) -> tuple[np.ndarray, np.ndarray]:
        """Image and number (into `near`) of each edge pixel, in order."""
        flat = self.near @ [seen.kept.shape[2], 1]
        return np.nonzero(np.take(seen.kept.reshape(len(seen.kept), -1), flat, 1))

    def _profiles(self, seen: Thinned, which: np.ndarray, pixel: np.ndarray) -> np.ndarray:
        """The kernel's results at edge pixels, shape (k, 8)."""
        size = 2 * self._radius + 1
        y, x = self.near[pixel].T - self._radius
        around = sliding_window_view(seen.parts, (size, size), (1, 2))[which, y, x]
        return around.reshape(which.size, size * size).astype(float) @ self.kernel

    def _sure(self, start: np.ndarray, trend: np.ndarray) -> np.ndarray:
        """Whether noise leaves hardly any point of the edge's dimmer half below the threshold, bool (n,).

        Told from the gradient at the edge's start and its change per px: of one image of many, or the noise-free one.
        """
        first, last = self.caliper.positions[[0, -1]]
        half = np.linspace(start + trend * np.where(trend > 0, first, last), start + trend * (first + last) / 2, 5)
        noise = _gradient_noise(self.optics, self.kernel)
        return ndtr((self.threshold - half) / max(noise, 1e-9 * self.threshold)).mean(0) < _LOST

    @property
    def _radius(self) -> int:
        return int(np.sqrt(len(self.kernel))) // 2

    @property
    def _limits(self) -> tuple[float, float]:
        return float(self.caliper.positions[0]) - 0.5, float(self.caliper.positions[-1]) + 0.5

    @property
    def _width(self) -> float:
        """Standard deviation of the smoothed gradient across the edge, px."""
        blur = self.caliper.blur(self.caliper.positions.mean())
        return float(np.hypot(self.optics.scale_px, edge_blur(blur)))

    @property
    def _curvature_to_contrast(self) -> float:
        """Contrast of a straight blurred edge whose gradient has curvature 1 at its top: what noise is divided by."""
        return float(np.sqrt(2 * np.pi) * self._width**3)

    @property
    def _step(self) -> float:
        """A contrast that passes the threshold everywhere."""
        return 4 * self.threshold * float(np.sqrt(2 * np.pi)) * self._width

    def _straight_edge(self) -> np.ndarray:
        """Noise-free image of an endless edge at the expected place, as far as it is looked at."""
        pixels = self.pixels
        y, x = np.divmod(pixels, self.optics.shape[1])
        _, across = self.caliper.coordinates(self.optics.ideal(np.stack([x, y], -1)[:, None] + NODES))
        image = np.zeros(self.optics.shape)
        middle = self.caliper.at(self.caliper.positions.mean(), np.zeros(()))
        blur = max(float(self.optics.blur_at(self.optics.recorded(middle))), 0.3)
        image.flat[pixels] = self._step * half_plane(across / blur) @ NODE_WEIGHTS
        return image


def _gradient_noise(optics: Optics, kernel: np.ndarray) -> float:
    """Standard deviation of the gradient across an edge by noise, grey levels a pixel."""
    return float(np.sqrt(optics.noise_variance) * np.linalg.norm(kernel[:, 0]))


def thinnings(optics: Optics, calipers: list[Caliper], threshold: float) -> list[Thinning]:
    """What chooses each edge's pixels: one for all, unless the edges' own windows together are the smaller job."""
    if not calipers:
        return []
    margin = int(np.ceil(TRUNCATE * optics.scale_px)) + 2
    near = [near_pixels(optics, caliper) for caliper in calipers]
    whole, *each = (_window(pixels, optics.shape, margin) for pixels in (np.concatenate(near), *near))
    if _area(whole) <= sum(map(_area, each)):
        return [Thinning.of(whole, optics.scale_px, _BESIDE * threshold)] * len(calipers)
    return [Thinning.of(window, optics.scale_px, _BESIDE * threshold) for window in each]


def near_pixels(optics: Optics, caliper: Caliper) -> np.ndarray:
    """Flat indices of the pixels within the search window of an edge, away from its corners."""
    ends = optics.recorded(caliper.at(caliper.positions[[0, -1]], np.zeros(2)))
    margin = optics.window_px + 1 + optics.sagitta
    low = np.maximum(np.floor(ends.min(0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(ends.max(0) + margin) + 1, optics.shape[::-1]).astype(int)
    y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
    along, offset = caliper.coordinates(optics.ideal(np.stack([x, y], -1).astype(float)))
    within = (along >= caliper.positions[0] - 0.5) & (along <= caliper.positions[-1] + 0.5)
    near = within & (np.abs(offset) <= optics.window_px)
    return y[near] * optics.shape[1] + x[near]


def _window(pixels: np.ndarray, shape: tuple[int, int], margin: int) -> tuple[slice, slice]:
    """Rows and columns that hold pixels (flat indices) and ``margin`` more on each side."""
    return tuple(
        slice(max(int(place.min()) - margin, 0), min(int(place.max()) + margin + 1, size))
        for place, size in zip(np.divmod(pixels, shape[1]), shape, strict=True)
    )


def _area(window: tuple[slice, slice]) -> int:
    return (window[0].stop - window[0].start) * (window[1].stop - window[1].start)


def _prepared(layout: Layout, threshold: float) -> SeparateEstimator:
    optics, calipers = layout.optics, calipers_for(layout, TRUNCATE)
    looks = iter(thinnings(optics, [caliper for caliper in calipers if measurable(caliper)], threshold))
    parts = by_points(optics, calipers, lambda caliper: CannyLocator.of(optics, caliper, threshold, next(looks)))
    different = {part.locator.thinning for part in parts if part}
    return SeparateEstimator(calipers, parts, different.pop() if len(different) == 1 else None)


CANNY = EstimatorKind(_prepared, capture_px=1.5, exact_px=0.006, bias_predicted=True, local=True)
