"""The estimators by name, prepared for a layout."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from measure import status
from measure.estimators.canny import CannyLocator
from measure.estimators.estimate import Estimate, Estimator, Response, scaled
from measure.estimators.gradient import GradientLocator
from measure.estimators.likelihood import LikelihoodEstimator
from measure.estimators.polygon import polygon_estimator
from measure.estimators.strip import strip_estimator
from measure.features.calipers import Caliper, edge_calipers
from measure.features.layout import Layout
from measure.features.lines import fit_lines, regression, trapezoid
from planner.features.locator import CLEARANCE, MIN_CONTRAST, edge_blur, reach
from scenes import InvalidInput

ESTIMATORS = ("canny", "gradient", "strip", "polygon")
CAPTURE = {"canny": 1.5, "gradient": 1.5, "strip": 0.125, "polygon": 0.125}
"""Largest offset from the expected edge, px, at which the result is as good as at none."""
_MIN_FOUND = 0.5  # part of an edge's positions at which a point must be found
_MAX_SCATTER = 0.8  # px; in noise alone points scatter by 0.9 to 1.5 (window 3 px), on the weakest edges by 0.3


def estimator(layout: Layout, name: str, threshold: float = 12.0) -> Estimator:
    """Prepare an estimator.

    Parameters
    ----------
    layout : Layout
    name : {"canny", "gradient", "strip", "polygon"}
    threshold : float
        Gradient threshold of ``canny``, grey levels a pixel.

    Raises
    ------
    InvalidInput
        If the name is unknown or the threshold not positive.
    """
    if name not in ESTIMATORS:
        raise InvalidInput(f"estimator must be one of {', '.join(ESTIMATORS)}, got {name!r}")
    if not threshold > 0:
        raise InvalidInput(f"threshold must be greater than 0, got {threshold!r}")
    optics = layout.optics
    own_reach = CLEARANCE * edge_blur(optics.blur_px)
    if name == "polygon":
        whole = edge_calipers(layout, 0.0, 0.0)
        found = polygon_estimator(layout, whole, own_reach) if _all_measurable(whole) else None
        if found is not None:
            return found
        name = "strip"  # no closed ring around one face: each edge by itself
    if name == "strip":
        calipers = edge_calipers(layout, own_reach, 0.0)
        parts = [strip_estimator(layout, f, i, own_reach) if _measurable(f) else None for i, f in enumerate(calipers)]
        calipers = tuple(
            f if p or not _measurable(f) else replace(f, status=status.SHORT)
            for f, p in zip(calipers, parts, strict=True)
        )
        return SeparateEstimator(calipers, tuple(parts))
    calipers = edge_calipers(layout, reach(optics.scale_px, optics.blur_px), optics.window_px + 4 * optics.scale_px + 1)
    if name == "gradient":
        calipers = tuple(_thinned(caliper, optics.scale_px) for caliper in calipers)
    make = GradientLocator.of if name == "gradient" else lambda o, f: CannyLocator.of(o, f, threshold)
    parts = tuple(
        PointEstimator(f, make(optics, f), optics.noise_variance) if _measurable(f) else None for f in calipers
    )
    return SeparateEstimator(calipers, parts)


def _thinned(caliper: Caliper, scale: float) -> Caliper:
    """Stations at most 2 scales apart, at least three: points in between add nothing (their errors are smooth)."""
    if caliper.positions.size < 3:
        return caliper
    first, last = caliper.positions[[0, -1]]
    return replace(caliper, positions=np.linspace(first, last, max(3, int(np.ceil((last - first) / (2 * scale))) + 1)))


def _measurable(caliper: Caliper) -> bool:
    return caliper.status in status.MEASURED


def _all_measurable(calipers: tuple[Caliper, ...]) -> bool:
    return all(caliper.status != status.NOT_VISIBLE for caliper in calipers)


@dataclass(frozen=True)
class PointEstimator:
    """One edge from edge points and a total-least-squares line."""

    caliper: Caliper
    locator: GradientLocator | CannyLocator
    noise_variance: float

    @property
    def weights(self) -> np.ndarray | float:
        """Of the edge points: few evenly spaced ones stand for the whole edge; Canny's pixels are what they are."""
        return trapezoid(self.caliper.positions) if isinstance(self.locator, GradientLocator) else 1.0

    @property
    def edge_calipers(self) -> tuple[Caliper, ...]:
        return (self.caliper,)

    @property
    def pixels(self) -> np.ndarray:
        return self.locator.pixels

    def estimate(self, images: np.ndarray) -> Estimate:
        points = self.locator.locate(images)
        lines = fit_lines(points, self.weights)
        slope = np.tan(lines.tilt)
        enough = points.valid.sum(1) >= np.maximum(_MIN_FOUND * self.caliper.positions.size, 3)
        clear = points.contrast > MIN_CONTRAST * np.sqrt(self.noise_variance)
        edge = enough & clear & (lines.scatter < _MAX_SCATTER)
        state = np.where(points.reversed, status.SIGN_CHANGE, np.where(edge, status.OK, status.LOW_CONTRAST))
        columns = (
            lines.mean_offset - slope * lines.mean_along,
            slope,
            np.stack([points.contrast, np.zeros_like(points.contrast)], -1),
            lines.count,
            np.maximum(self.caliper.positions.size - lines.count, 0),
            state,
        )
        return Estimate(*(column[:, None] for column in columns))

    def covariance(self, estimate: Estimate) -> np.ndarray:
        return scaled(self.locator.unit_covariance(), estimate.contrast[..., 0], self.caliper.positions.mean()[None])

    def respond(self, clean: np.ndarray) -> Response:
        points, response = self.locator.linear_response(clean)
        count = response.shape[0]
        keep = points.valid[0, :count]
        if keep.sum() < 2:  # no edge at its expected place: `find_shape` may find one elsewhere
            return Response(self.estimate(clean[None]), np.full((2, clean.size), np.nan))
        along, weights = points.along[0, :count][keep], np.broadcast_to(self.weights, keep.shape)[keep]
        mean, slope = (sparse.csr_array(response)[np.flatnonzero(keep)].T @ regression(along, weights).T).T
        middle = weights @ along / weights.sum()
        return Response(self.estimate(clean[None]), np.stack([mean - middle * slope, slope]))


@dataclass(frozen=True)
class SeparateEstimator:
    """Several edges, each by an estimator of its own; None for an edge that cannot be measured."""

    calipers: tuple[Caliper, ...]
    parts: tuple[PointEstimator | LikelihoodEstimator | None, ...]

    @property
    def pixels(self) -> np.ndarray:
        return np.unique(np.concatenate([np.empty(0, int), *(part.pixels for part in self.parts if part)]))

    def estimate(self, images: np.ndarray) -> Estimate:
        n = len(images)
        nothing = np.full((n, 1), np.nan)
        none = np.zeros((n, 1), int)
        missing = Estimate(nothing, nothing, np.zeros((n, 1, 2)), none, none, np.full((n, 1), status.LOW_CONTRAST))
        parts = [part.estimate(images) if part else missing for part in self.parts]
        return Estimate(*(np.concatenate(column, 1) for column in zip(*parts, strict=True)))

    def covariance(self, estimate: Estimate) -> np.ndarray:
        edges = len(self.parts)
        whole = np.zeros((len(estimate.level), 2 * edges, 2 * edges))
        for e, part in enumerate(self.parts):
            if part:
                here = slice(2 * e, 2 * e + 2)
                whole[:, here, here] = part.covariance(Estimate(*(column[:, e : e + 1] for column in estimate)))
        return whole

    def respond(self, clean: np.ndarray) -> Response:
        responses = [part.respond(clean).lines if part else np.zeros((2, clean.size)) for part in self.parts]
        return Response(self.estimate(clean[None]), np.concatenate(responses))
