"""Edges that are measured one by one: points along each, a line through them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from imaging.features.locator import points_along, reach
from measure.estimators.crossing import CrossingLocator
from measure.estimators.estimate import Estimate, noisy
from measure.estimators.thinning import Thinned, Thinning
from measure.features.calipers import Caliper, edge_calipers
from measure.features.layout import Layout, Optics
from measure.features.lines import (
    by_noise,
    fit_lines,
    inverse_contrast,
    level_and_slope,
    line_map,
    line_state,
)
from measure.features.points import EdgePoints
from measure.features.rim_noise import Drawn, drawn, is_linear
from scenes import status

if TYPE_CHECKING:
    from measure.estimators.canny import CannyLocator


def calipers_for(layout: Layout, kernel_sigmas: float, trim: float | None = None) -> tuple[Caliper, ...]:
    """Calipers of a layout's edges for a locator whose kernel ends after so many smoothing scales.

    With ``trim`` that part of the reach is left out beside each corner, and an edge within the reach makes another one
    ``clutter``; without it all of the reach is, and the predicted bias says what is ``clutter``.
    """
    optics = layout.optics
    beside = reach(optics.scale_px, optics.most_blur_px)
    margin = optics.window_px + kernel_sigmas * optics.scale_px + 1
    if trim is None:
        return edge_calipers(layout, beside, margin)
    return edge_calipers(layout, trim * beside, margin, beside)


def by_points(
    optics: Optics, calipers: tuple[Caliper, ...], locator: Callable[[Caliper], CrossingLocator | CannyLocator]
) -> tuple[PointEstimator | None, ...]:
    """An estimator of each edge that can be measured, by its locator."""
    return tuple(PointEstimator(f, locator(f)) if measurable(f) else None for f in calipers)


def thinned(caliper: Caliper, scale: float) -> Caliper:
    """Positions that are enough (`imaging.features.locator.points_along`)."""
    if caliper.positions.size < 3:
        return caliper
    first, last = caliper.positions[[0, -1]]
    return replace(caliper, positions=np.linspace(first, last, points_along(float(last - first), scale)))


def measurable(caliper: Caliper) -> bool:
    """Whether its edge can be measured at all."""
    return caliper.status in status.MEASURED


@dataclass(frozen=True)
class PointEstimator:
    """One edge from edge points and a total-least-squares line."""

    caliper: Caliper
    locator: CrossingLocator | CannyLocator

    @property
    def calipers(self) -> tuple[Caliper, ...]:
        return (self.caliper,)

    @property
    def pixels(self) -> np.ndarray:
        return self.locator.pixels

    def estimate(self, images: np.ndarray | Thinned | Drawn, noise_variance: np.ndarray | float) -> Estimate:
        """As `Estimator.estimate`; ``noise_variance`` (n,) is the mean along the edge, grey levels^2."""
        points = self.locator.locate(images)
        lines = fit_lines(points, points.weights)
        level, slope, contrast = level_and_slope(points, lines)
        size = self.caliper.positions.size
        state = line_state(points, lines, size, self.locator.least_contrast, noise_variance)
        columns = level, slope, contrast, lines.count, np.maximum(size - lines.count, 0), state
        return Estimate(*(column[:, None] for column in columns))

    def covariance(self, estimate: Estimate, images: np.ndarray) -> np.ndarray:
        """That of a straight edge whose points' errors go with 1 / contrast, a parabola through three places."""
        inverse = inverse_contrast(estimate.contrast[:, 0], self._places)
        moments = noisy(self._responses, self.caliper.optics, images, self.pixels)
        shape = (len(inverse) if moments.ndim == 3 else 1, 2, 3, 2, 3)
        moments = np.broadcast_to(moments.reshape(shape), (len(inverse), *shape[1:]))
        return np.einsum("nj,nk,najbk->nab", inverse, inverse, moments)

    @property
    def _places(self) -> np.ndarray:
        """Start, middle and end of the part of the edge that is measured, px."""
        return np.linspace(*self.caliper.positions[[0, -1]], 3)

    @cached_property
    def _responses(self) -> np.ndarray:
        """Derivative of (level, slope) by `pixels` where 1 / contrast is 1 at one of `_places`, 0 at others, (6, P)."""
        noise = self.locator.unit_noise()
        return by_noise(noise.along, noise.weights, self._places) @ noise.response

    def respond_within(self, clean: np.ndarray, pixels: np.ndarray, *, asked: bool = False) -> np.ndarray:
        """Derivative of (level, slope) by some pixels, flat indices in order that hold all of `pixels`, (2, P).

        Where noise may decide which of two edges a point is on, drawn noise is ``asked`` whether the line's errors are
        those that it tells; NaN where they are not.
        """
        points, response = self._response(clean)
        told = response.tocoo()
        found = np.zeros((2, pixels.size))
        row, column = told.coords
        found[row, np.searchsorted(pixels, column)] = told.data
        if asked and self.locator.may_jump(points, clean) and not self._tells_errors(response, clean):
            found[:] = np.nan
        return found

    def _tells_errors(self, response: sparse.csr_array, clean: np.ndarray) -> bool:
        """Whether a line's errors by noise are those that its derivative tells."""
        noise = float(np.mean(self.noise_of(clean[None])))
        (here,), linear, full, found = self._lines(clean[None], noise)[0], [], [], []
        for images in drawn(clean, self.pixels, self.caliper.optics):
            each, good = self._lines(images, noise)
            linear.append(images.first_order(response))
            full.append(each - here)
            found.append(good)
        return is_linear(*map(np.concatenate, (linear, full, found)))

    def noise_of(self, images: np.ndarray) -> np.ndarray | float:
        """Mean variance of the noise at the edge's pixels, grey levels^2, of all images or of each (n,)."""
        optics = self.caliper.optics
        if optics.noise is None or optics.noise.gain <= 0:
            return optics.noise_variance
        return optics.noise_at(images.reshape(len(images), -1)[:, self.pixels]).mean(1)

    def _lines(self, images: np.ndarray | Drawn, noise_variance: float) -> tuple[np.ndarray, np.ndarray]:
        """(level, slope), (n, 2), and whether there is a line, (n,)."""
        found = self.estimate(images, noise_variance)
        return np.concatenate([found.level, found.slope], 1), np.isin(found.state[:, 0], status.MEASURED)

    def _response(self, clean: np.ndarray) -> tuple[EdgePoints, sparse.csr_array]:
        """Edge points, and the derivative of (level, slope) by an image's pixels, (2, H W)."""
        points, response = self.locator.linear_response(clean)
        keep = points.valid[0]
        if keep.sum() < 2:  # no edge at its expected place: `find_shape` may find one elsewhere
            pixels = np.tile(self.pixels, 2)
            nothing = np.full(pixels.size, np.nan), pixels, np.arange(3) * len(self.pixels)
            return points, sparse.csr_array(nothing, (2, clean.size))
        weights = np.broadcast_to(points.weights, points.along.shape)[0, keep]
        lines = line_map(points.along[0, keep], weights)
        return points, sparse.csr_array(lines) @ sparse.csr_array(response)[np.flatnonzero(keep)]


@dataclass(frozen=True)
class SeparateEstimator:
    """Several edges, each by an estimator of its own; None for an edge that cannot be measured."""

    calipers: tuple[Caliper, ...]
    parts: tuple[PointEstimator | None, ...]
    thinning: Thinning | None = None
    """Canny's choice of pixels where it is made once for all parts."""

    @property
    def pixels(self) -> np.ndarray:
        return np.unique(np.concatenate([np.empty(0, int), *(part.pixels for part in self.parts if part)]))

    def estimate(self, images: np.ndarray) -> Estimate:
        n = len(images)
        nothing = np.full((n, 1), np.nan)
        none = np.zeros((n, 1), int)
        missing = Estimate(nothing, nothing, np.zeros((n, 1, 2)), none, none, np.full((n, 1), status.LOW_CONTRAST))
        seen = self.thinning(images) if self.thinning else images
        parts = [missing if part is None else part.estimate(seen, part.noise_of(images)) for part in self.parts]
        return Estimate(*(np.concatenate(column, 1) for column in zip(*parts, strict=True)))

    def covariance(self, estimate: Estimate, images: np.ndarray) -> np.ndarray:
        edges = len(self.parts)
        whole = np.zeros((len(estimate.level), 2 * edges, 2 * edges))
        for e, part in enumerate(self.parts):
            if part:
                here = slice(2 * e, 2 * e + 2)
                own = Estimate(*(column[:, e : e + 1] for column in estimate))
                whole[:, here, here] = part.covariance(own, images)
        return whole

    def respond_within(self, clean: np.ndarray, *, asked: bool = False) -> np.ndarray:
        pixels = self.pixels
        return np.concatenate([part.respond_within(clean, pixels, asked=asked) if part else np.zeros((2, pixels.size))
                               for part in self.parts])  # fmt: skip
