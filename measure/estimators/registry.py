"""The estimators by name, prepared for a layout."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy import sparse

from imaging.features.locator import CLEARANCE, edge_blur, reach
from imaging.light.appearance import is_plain
from measure.estimators.arrangement import ArrangementEstimator
from measure.estimators.canny import CannyLocator, thinnings
from measure.estimators.crossing import CrossingLocator
from measure.estimators.estimate import Estimate, noisy
from measure.estimators.gradient import gradient_locator
from measure.estimators.isophote import TRIM, isophote_locator
from measure.estimators.likelihood import LikelihoodEstimator
from measure.estimators.profile import TRUNCATE
from measure.estimators.strip import strip_estimator
from measure.estimators.thinning import Thinned, Thinning
from measure.features.calipers import Caliper, edge_calipers
from measure.features.layout import Layout, Optics
from measure.features.lines import fit_lines, regression
from scenes import InvalidInput, Noise, Scene, status

ESTIMATORS = ("canny", "gradient", "isophote", "strip", "arrangement")
SYNONYMS = {"polygon": "arrangement"}  # a polygon alone is the simplest arrangement
CAPTURE = {"canny": 1.5, "gradient": 1.5, "isophote": 0.5, "strip": 0.125}
"""Largest offset from the expected edge, px, at which the result is as good as at none."""
_FEWEST = 9  # positions on an edge, however short: fewer do not stand for the integral along it
_MIN_FOUND = 0.5  # part of an edge's positions at which a point must be found
_DIMMEST = 0.1  # contrast at an end over that in the middle, below which it is no straight line any more
_FAINTEST = 1e-3  # grey levels of noise: about what the image of an arrangement is exact to
_MAX_SCATTER = 0.8  # px; in noise alone points scatter by 0.9 to 1.5 (window 3 px), on the weakest edges by 0.3


def best_estimator(scene: Scene) -> str:
    """What an image of a scene is best measured by: ``arrangement`` where one convex body stands before darkness.

    There it is the most precise, and tells by its goodness of fit whether the image is what it takes it for. Where
    things hide or shade each other, ``gradient``, whose errors and bias the planner knows.
    """
    return "arrangement" if is_plain(scene) else "gradient"


def known_name(name: str) -> str:
    """The estimator's name, of a synonym too; raises InvalidInput if there is none of this name."""
    name = SYNONYMS.get(name, name)
    if name not in ESTIMATORS:
        raise InvalidInput(f"estimator must be one of {', '.join(ESTIMATORS)}, got {name!r}")
    return name


def estimator(layout: Layout, name: str, threshold: float = 12.0) -> AnyEstimator:
    """Prepare an estimator.

    Parameters
    ----------
    layout : Layout
    name : {"canny", "gradient", "isophote", "strip", "arrangement"}
        ``polygon`` is a synonym of ``arrangement``.
    threshold : float
        Gradient threshold of ``canny``, grey levels a pixel.

    Raises
    ------
    InvalidInput
        If the name is unknown or not for such a layout, or the threshold not positive.
    """
    name = known_name(name)
    if not threshold > 0:
        raise InvalidInput(f"threshold must be greater than 0, got {threshold!r}")
    optics = layout.optics
    own_reach = CLEARANCE * edge_blur(optics.blur_px)  # a face less than twice as wide has no pixel of its own level
    if name == "arrangement":
        if layout.arrangement is None:
            rest = ", ".join(each for each in ESTIMATORS if each != name)
            raise InvalidInput(
                f"estimator must be one of {rest} for what is no convex body before darkness, got {name!r}"
            )
        return ArrangementEstimator(layout.arrangement, optics.shape, _noisy(optics.sensor))
    if name == "strip":
        calipers = edge_calipers(layout, own_reach, 0.0, 2 * own_reach)
        parts = [strip_estimator(layout, f, i, own_reach) if _measurable(f) else None for i, f in enumerate(calipers)]
        calipers = tuple(
            f if p or not _measurable(f) else replace(f, status=status.SHORT)
            for f, p in zip(calipers, parts, strict=True)
        )
        return LikelihoodEstimator.joined(calipers, parts)
    kernel = (TRUNCATE if name == "canny" else 4) * optics.scale_px
    beside, margin = reach(optics.scale_px, optics.blur_px), optics.window_px + kernel + 1
    if name == "isophote":
        return _isophotes(layout, edge_calipers(layout, TRIM / CLEARANCE * beside, margin, beside))
    calipers = edge_calipers(layout, beside, margin)
    if name == "gradient":
        calipers = tuple(_thinned(caliper, optics.scale_px) for caliper in calipers)
        return SeparateEstimator(calipers, _by_points(optics, calipers, partial(gradient_locator, optics)))
    looks = iter(thinnings(optics, [caliper for caliper in calipers if _measurable(caliper)], threshold))
    parts = _by_points(optics, calipers, lambda caliper: CannyLocator.of(optics, caliper, threshold, next(looks)))
    different = {part.locator.thinning for part in parts if part}
    return SeparateEstimator(calipers, parts, different.pop() if len(different) == 1 else None)


def _isophotes(layout: Layout, calipers: tuple[Caliper, ...]) -> SeparateEstimator:
    """Each edge by its isophote; `clutter` where one of its sides has no level of its own."""
    parts, found = [], []
    for index, caliper in enumerate(calipers):
        part = None
        if _measurable(caliper):
            locator, state = isophote_locator(layout, index, _thinned(caliper, layout.optics.scale_px))
            part = PointEstimator(replace(caliper, positions=locator.positions), locator)
            caliper = replace(part.caliper, status=status.worst(caliper.status, state))
        found.append(caliper)
        parts.append(part)
    return SeparateEstimator(tuple(found), tuple(parts))


def _by_points(
    optics: Optics, calipers: tuple[Caliper, ...], locator: Callable[[Caliper], CrossingLocator | CannyLocator]
) -> tuple[PointEstimator | None, ...]:
    return tuple(PointEstimator(f, locator(f)) if _measurable(f) else None for f in calipers)


def _thinned(caliper: Caliper, scale: float) -> Caliper:
    """Positions at most 2 scales apart, and not too few: points in between add nothing (their errors are smooth)."""
    if caliper.positions.size < 3:
        return caliper
    first, last = caliper.positions[[0, -1]]
    return replace(
        caliper, positions=np.linspace(first, last, max(_FEWEST, int(np.ceil((last - first) / (2 * scale))) + 1))
    )


def _measurable(caliper: Caliper) -> bool:
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

    def estimate(self, images: np.ndarray | Thinned, noise_variance: np.ndarray | float) -> Estimate:
        """As `Estimator.estimate`; ``noise_variance`` (n,) is the mean along the edge, grey levels^2."""
        points = self.locator.locate(images)
        lines = fit_lines(points, points.weights)
        slope = np.tan(lines.tilt)
        enough = points.valid.sum(1) >= np.maximum(_MIN_FOUND * self.caliper.positions.size, 3)
        clear = points.contrast > self.locator.least_contrast * np.sqrt(noise_variance)
        edge = enough & clear & points.sure & (lines.scatter < _MAX_SCATTER)
        state = np.where(points.reversed, status.SIGN_CHANGE, np.where(edge, status.OK, status.LOW_CONTRAST))
        columns = (
            lines.mean_offset - slope * lines.mean_along,
            slope,
            np.stack([points.contrast - points.trend * lines.mean_along, points.trend], -1),
            lines.count,
            np.maximum(self.caliper.positions.size - lines.count, 0),
            state,
        )
        return Estimate(*(column[:, None] for column in columns))

    def covariance(self, estimate: Estimate, images: np.ndarray) -> np.ndarray:
        """That of a straight edge whose points' errors go with 1 / contrast, a parabola through three places."""
        contrast = estimate.contrast[..., :1] + estimate.contrast[..., 1:] * self._places
        middle = contrast[:, 0, 1:2]
        inverse = 1 / np.where(middle > 0, np.maximum(contrast[:, 0], _DIMMEST * middle), np.nan)
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
        lines = _level_and_slope(noise.along, noise.weights)
        shapes = np.linalg.inv(np.vander(self._places, 3)).T @ np.vander(noise.along, 3).T
        return (lines[:, None] * shapes).reshape(6, -1) @ noise.response

    def respond(self, clean: np.ndarray) -> np.ndarray:
        return self._response(clean).toarray()

    def respond_within(self, clean: np.ndarray, pixels: np.ndarray) -> np.ndarray:
        """The same at some pixels, flat indices in order that hold all of `pixels`, (2, P)."""
        told = self._response(clean).tocoo()
        found = np.zeros((2, pixels.size))
        row, column = told.coords
        found[row, np.searchsorted(pixels, column)] = told.data
        return found

    def _response(self, clean: np.ndarray) -> sparse.csr_array:
        """Derivative of (level, slope) by an image's pixels, (2, H W)."""
        points, response = self.locator.linear_response(clean)
        count = response.shape[0]
        keep = points.valid[0, :count]
        if keep.sum() < 2:  # no edge at its expected place: `find_shape` may find one elsewhere
            pixels = np.tile(self.pixels, 2)
            return sparse.csr_array(
                (np.full(pixels.size, np.nan), pixels, np.arange(3) * len(self.pixels)), (2, clean.size)
            )
        weights = np.broadcast_to(points.weights, points.along.shape)[0, :count][keep]
        lines = _level_and_slope(points.along[0, :count][keep], weights)
        return sparse.csr_array(lines) @ sparse.csr_array(response)[np.flatnonzero(keep)]


def _level_and_slope(along: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Linear map from offsets at places (m,) to (offset at the start of the edge, slope), (2, m)."""
    mean, slope = regression(along, weights)
    return np.stack([mean - (weights @ along) / weights.sum() * slope, slope])


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
        parts = [missing if part is None else part.estimate(seen, _noise_of(part, images)) for part in self.parts]
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

    def respond(self, clean: np.ndarray) -> np.ndarray:
        return np.concatenate([part.respond(clean) if part else np.zeros((2, clean.size)) for part in self.parts])

    def respond_within(self, clean: np.ndarray) -> np.ndarray:
        """The same at `pixels` alone, (2 E, P)."""
        pixels = self.pixels
        return np.concatenate([part.respond_within(clean, pixels) if part else np.zeros((2, pixels.size))
                               for part in self.parts])  # fmt: skip


def _noise_of(part: PointEstimator, images: np.ndarray) -> np.ndarray | float:
    """Mean variance of the noise at the pixels of one edge, grey levels^2, of all images or of each (n,)."""
    optics = part.caliper.optics
    if optics.noise is None or optics.noise.gain <= 0:
        return optics.noise_variance
    return optics.noise_at(images.reshape(len(images), -1)[:, part.pixels]).mean(1)


def _noisy(noise: Noise) -> Noise:
    """The noise, or the least that a likelihood can be made of."""
    return noise if noise.variance >= _FAINTEST**2 else noise.model_copy(update={"sigma": _FAINTEST})


AnyEstimator = SeparateEstimator | LikelihoodEstimator | ArrangementEstimator
