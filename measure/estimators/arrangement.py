"""Maximum likelihood of all visible faces around the required edges together.

Unknown are the image positions of all vertices near the required edges, a level on each face, the background and the
blur; `imaging.blurred.model` says what image they make. From the expected place Fisher scoring climbs to the
likelihood's maximum, with the model evaluated anew at each step. `measure.estimators.stack` solves the other images of
a stack around the place found for one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from imaging.blurred.arrangement import Arrangement
from imaging.blurred.model import BlurredModel, State
from imaging.models.bound import Known, known, response
from imaging.models.reach import model_within, reach_of
from imaging.sensor import Levels, squared_errors
from measure.estimators.expansion import Expansion, Pieces
from measure.estimators.kinds import ESTIMATORS, EstimatorKind
from measure.features.layout import Layout
from scenes import InvalidInput, Noise

_STEPS = 50
_SCORED = 5  # steps of Fisher scoring before those of Newton: it ends sooner where little is known
_LEAST = 1e-6  # eigenvalue of a scaled second derivative below which there is no maximum
_STRIDE = 0.7  # px that a vertex may go in one step: about the width of an edge
_BLURRED = 3.0  # times the expected blur at which steps are given up
_LOST = 40.0  # px from the expected place at which they are
_SETTLED = 1e-3  # of a standard deviation
_ROUNDING = 1e-5  # of a chi-square: what is less is no difference
_WHOLE = 1 - 1e-9  # of the sensor's sensitivity: less where the scale ends
_FAINTEST = 1e-3  # grey levels of noise: about what the image of an arrangement is exact to
_FREE = 1e3  # px: a standard deviation at which nothing is known


class Point(NamedTuple):
    """The likelihood at one state for one image.

    Attributes
    ----------
    state : State
    before : ndarray, shape (q,)
        What was known of the parameters.
    expected, weight, gain : ndarray, shape (P,)
        Recorded level, one over the variance of its noise, its derivative by the signal.
    jacobian : ndarray, shape (P, q)
        Derivative of the signal by the parameters.
    told : ndarray, shape (P,)
        Derivative of the log likelihood by the signal.
    fisher, score : ndarray, shape (q, q) and (q,)
        Information and derivative of the log likelihood, what was known before included.
    cost : float
        Chi-square, and what the parameters' distance from what was known before adds.
    """

    state: State
    before: np.ndarray
    expected: np.ndarray
    weight: np.ndarray
    gain: np.ndarray
    jacobian: np.ndarray
    told: np.ndarray
    fisher: np.ndarray
    score: np.ndarray
    cost: float


class Likeliest(NamedTuple):
    """The likelihood's maximum in one image.

    Attributes
    ----------
    point : Point
    inverse : ndarray, shape (q, q)
        Of the information there.
    settled : bool
        Whether the steps ended.
    rivalled : bool
        Whether another maximum, elsewhere, explains the image within the noise as well.
    """

    point: Point
    inverse: np.ndarray
    settled: bool
    rivalled: bool = False

    @property
    def state(self) -> State:
        return self.point.state

    @property
    def cost(self) -> float:
        return self.point.cost


@dataclass(frozen=True, eq=False)
class Centre:
    """A state with what images near it need.

    Attributes
    ----------
    state : State
    expansion : Expansion
    covariance : ndarray, shape (q, q)
        Of the parameters' errors.
    freedom, scale : tuple of float
        Degrees of freedom of each chi-square, and the factor on it (1, but where the scale cuts noise off).
    settled, rivalled : bool
        As in `Likeliest`.
    """

    state: State
    expansion: Expansion
    covariance: np.ndarray
    freedom: tuple[float, float, float]
    scale: tuple[float, float, float]
    settled: bool
    rivalled: bool


@dataclass(frozen=True, eq=False)
class ArrangementEstimator:
    """Prepared for one expected arrangement in images of one shape.

    Attributes
    ----------
    arrangement : Arrangement
    shape : tuple of int
        (height, width).
    noise : Noise
    still : frozenset of int
        Vertices that follow the required ones, because no piece that ends there is seen in the images.
    """

    arrangement: Arrangement
    shape: tuple[int, int]
    noise: Noise
    still: frozenset[int] = frozenset()

    @cached_property
    def model(self) -> BlurredModel:
        """The image at the pixels near the required edges."""
        return model_within(self.arrangement, self.shape, self.reach)

    @cached_property
    def reach(self) -> float:
        """Distance from a required edge up to which pixels are used, px."""
        return reach_of(self.arrangement, self.shape, self.noise)

    @cached_property
    def pixels(self) -> np.ndarray:
        """Flat indices of the pixels that it looks at."""
        return self.model.y * self.shape[1] + self.model.x

    @cached_property
    def known(self) -> Known:
        """What is known of (vertices, levels, blur) before, shapes (q, q) and (q,)."""
        return known(self.model, self.still)

    @cached_property
    def prior(self) -> np.ndarray:
        """Its precision, with next to nothing known of all else, so that everything has a most likely value."""
        model, sigma = self.model, np.sqrt(max(self.noise.variance, 1e-12))
        levels = [
            np.full(region.count, (1e4 * sigma) ** -2 * (not region.known)) for region in self.arrangement.regions
        ]
        weak = np.concatenate([np.full(2 * model.free.size, _FREE**-2), *levels, [0.0]])
        return self.known.precision + np.diag(weak)

    def before(self, used: np.ndarray) -> np.ndarray:
        """What is known of the parameters before (q,); levels that no light tells are about those of an image (P,)."""
        mean, middle = self.known.mean.copy(), float(np.median(used)) - self.noise.dark_level
        for region, levels in zip(self.arrangement.regions, self.arrangement.level_slices, strict=True):
            mean[2 * self.model.free.size + levels.start] += 0.0 if region.known else middle
        return mean

    def parameters(self, state: State) -> np.ndarray:
        """All parameters as one array (q,)."""
        return np.concatenate([state.vertices[self.model.free].ravel(), state.levels, [state.blur]])

    def taken(self, images: np.ndarray | Sequence[np.ndarray], order: np.ndarray | slice = slice(None)) -> np.ndarray:
        """The used pixels of n images (height, width), (n, P)."""
        pixels = self.pixels[order]
        return np.stack([image.ravel().take(pixels) for image in images]).astype(float, copy=False)

    def expected(self, state: State, derivatives: bool = True):
        """Recorded level (P,), one over its noise's variance, its derivative by the signal, the signal's Jacobian."""
        image, jacobian = self.model.evaluate(state, derivatives)
        levels, gain = response(self.noise, image)
        return levels.level, 1 / levels.noise_variance, gain, jacobian

    def start(self, used: np.ndarray, vertices: np.ndarray | None = None) -> State:
        """The expected place, or another, with the levels that fit one image (P,) best there."""
        state = self.model.start()
        state = state if vertices is None else state._replace(vertices=vertices)
        design, precision, mean = self.model.design(state).T, self.prior, self.before(used)
        weight = 1 / response(self.noise, np.maximum(used - self.noise.dark_level, 0))[0].noise_variance
        first, last = 2 * self.model.free.size, -1
        known = precision[first:last, first:last]
        matrix = design.T @ (design * weight[:, None]) + known
        told = design.T @ (weight * (used - self.noise.dark_level)) + known @ mean[first:last]
        return state._replace(levels=np.linalg.solve(matrix, told))

    @property
    def is_lit(self) -> bool:
        """Whether the light says how bright each face is."""
        return all(region.known for region in self.arrangement.regions[1:])

    @cached_property
    def reference(self) -> Centre:
        """The expected state, where the light is known."""
        state = self.model.start()
        return self.centre(self.climb(self.expected(state, derivatives=False)[0], state))

    def drawn(self, centre: Centre, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Errors of the parameters in ``count`` drawn images of a state, to first order and in full, both (n, q).

        Always the same draws. NaN from the first on in which the steps do not end.
        """
        expected, weight, gain, jacobian = self.expected(centre.state)
        half = np.random.default_rng(0).standard_normal((count // 2, len(expected)))
        noise, truth = np.concatenate([half, -half]), self.parameters(centre.state)
        linear = (noise * np.sqrt(weight) * gain) @ jacobian @ centre.expansion.inverse
        full = np.full_like(linear, np.nan)
        for row, part in zip(full, noise, strict=True):
            fit = self.climb(expected + part / np.sqrt(weight), centre.state, truth)
            if not fit.settled:
                break
            row[:] = self.parameters(fit.state) - truth
        return linear, full

    def climb(self, used: np.ndarray, state: State, mean: np.ndarray | None = None) -> Likeliest:
        """Fisher scoring from a state to the likelihood's maximum for one image (P,).

        ``mean`` (q,) is what is known of the parameters before, that of `before` when not given.
        """
        mean = self.before(used) if mean is None else mean
        point, damping, settled = self._point(used, state, mean), 0.0, False
        for number in range(_STEPS):
            matrix = point.fisher if number < _SCORED else self._newton(point)
            point, settled, damping = self._step(used, point, matrix, damping)
            if settled or self._is_lost(point.state):
                break
        return Likeliest(point, _inverse(point.fisher), settled)

    def _is_lost(self, state: State) -> bool:
        """Whether the steps have gone where no measurement is."""
        ends = np.unique(self.arrangement.required[self.arrangement.required >= 0])
        away = np.abs(state.vertices[ends] - self.arrangement.vertices[ends]).max(initial=0.0)
        return bool(state.blur > _BLURRED * self.model.start().blur or away > _LOST)

    def _point(self, used: np.ndarray, state: State, mean: np.ndarray) -> Point:
        """The likelihood and its derivatives at a state."""
        precision, before = self.prior, mean - self.parameters(state)
        expected, weight, gain, jacobian = self.expected(state)
        root, away = np.sqrt(weight), used - expected
        weighted = jacobian * (gain * root)[:, None]
        return Point(
            state, mean, expected, weight, gain, jacobian,
            told=gain * weight * away,
            fisher=weighted.T @ weighted + precision,
            score=(root * away) @ weighted + precision @ before,
            cost=float(away @ (weight * away) + before @ precision @ before),
        )  # fmt: skip

    def _newton(self, point: Point) -> np.ndarray:
        """Second derivative of the cost (q, q) where it is positive: the residual bends it in slivers."""
        pieces, small = Pieces.of(self.model, point.state), 1e-4 * np.eye(self.model.count)
        rows = np.stack([rows @ point.told[pixels] for pixels, rows in zip(pieces.pixels, pieces.rows, strict=True)])
        rows = np.broadcast_to(rows, (len(small), *rows.shape))
        bent = (pieces.gradient(pieces.displaced(small), rows) - pieces.gradient(pieces.displaced(-small), rows)) / 2e-4
        matrix, scale = point.fisher - (bent + bent.T) / 2, 1 / np.sqrt(np.diag(point.fisher))
        return matrix if np.linalg.eigvalsh(matrix * scale[:, None] * scale)[0] > _LEAST else point.fisher

    def _step(self, used, point: Point, matrix, damping) -> tuple[Point, bool, float]:
        """The next point, by a step damped until the likelihood grows; whether it is the last; the damping."""
        for _ in range(12):
            step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), point.score)
            size = float(step @ matrix @ step)
            if size < _SETTLED**2 and damping == 0:
                return point, True, 0.0
            there = self._point(used, self.model.moved(point.state, self._held_back(step)), point.before)
            if self._cost(used, there, point.weight) <= point.cost + _ROUNDING:
                return there, size < _SETTLED**2, damping / 10 if damping > 1e-3 else 0.0
            if size < _SETTLED**2:
                return point, True, 0.0
            damping = max(10 * damping, 1e-3)
        return point, True, damping

    def _cost(self, used: np.ndarray, point: Point, weight: np.ndarray) -> float:
        """The cost at a point with weights (P,) of another: a score is the slope of this one, weights held."""
        away, before = used - point.expected, point.before - self.parameters(point.state)
        return float(away @ (weight * away) + before @ self.prior @ before)

    def _held_back(self, step: np.ndarray) -> np.ndarray:
        """A step (q,) no longer than what is known of vertices and blur is good for."""
        vertices, blur = np.abs(step[: 2 * self.model.free.size]).max(initial=0.0), abs(float(step[-1]))
        return step / max(1.0, vertices / _STRIDE, blur / (0.5 * self.model.start().blur))

    def centre(self, fit: Likeliest) -> Centre:
        """Prepare a state for a stack of images."""
        precision, point = self.prior, fit.point
        first = 2 * self.model.free.size
        expansion = Expansion.of(
            Pieces.of(self.model, fit.state), point.expected, point.weight, point.gain, point.jacobian[:, first:],
            fit.inverse, precision, point.before - self.parameters(fit.state),
        )  # fmt: skip
        spread = fit.inverse - fit.inverse @ self.known.precision @ fit.inverse
        taken = np.trace(fit.inverse[first:, first:] @ expansion.gram_far)
        fitted = len(precision) - (precision * fit.inverse).sum() - taken
        squares = [part[expansion.order] for part in self._squares(point)]
        near, far = slice(None, expansion.near), slice(expansion.near, None)
        parts = [_chi_square(*(part[which].sum() for part in squares), less)
                 for which, less in ((near, fitted), (far, taken))]  # fmt: skip
        freedom, scale = zip(*parts, (float(len(expansion.bows[1])), 1.0), strict=True)
        return Centre(fit.state, expansion, spread, freedom, scale, fit.settled, fit.rivalled)

    def _squares(self, point: Point) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance of each pixel's squared residual in standard deviations, without a fit, both (P,)."""
        level = point.expected
        if (point.gain < _WHOLE).any():
            level = self.model.evaluate(point.state, False)[0] + self.noise.dark_level
        return squared_errors(self.noise, level, Levels(point.expected, 1 / point.weight))

    def index(self, vertices: np.ndarray) -> np.ndarray:
        """Where free vertices' x and y stand among the parameters."""
        return (2 * np.searchsorted(self.model.free, vertices)[:, None] + [0, 1]).ravel()

    def wherever(self, centre: Centre) -> np.ndarray:
        """Covariance of the parameters (q, q) if nothing is known of vertices before but of those that are still."""
        rest = known(self.model, self.still, follows=np.inf).precision
        inverse = _inverse(_inverse(centre.expansion.inverse) - self.known.precision + rest)
        return inverse - inverse @ rest @ inverse

    def response(self, used: np.ndarray) -> np.ndarray:
        """Derivative of the parameters by the pixels, (q, P), at the expected place with an image's own levels (P,)."""
        point = self._point(used, self.start(used), self.before(used))
        return _inverse(point.fisher) @ (point.jacobian * (point.gain * point.weight)[:, None]).T

    def derivative(self, centre: Centre) -> np.ndarray:
        """Derivative of the parameters by the pixels at a state, (q, P)."""
        _, weight, gain, jacobian = self.expected(centre.state)
        return centre.expansion.inverse @ (jacobian * (gain * weight)[:, None]).T


def _chi_square(mean: float, variance: float, fitted: float) -> tuple[float, float]:
    """Degrees of freedom, and the factor on it, of the chi-square with the mean and variance of a sum of squares.

    Fitted parameters take 1 each from the mean and 2 from the variance.
    """
    mean, variance = mean - fitted, variance - 2 * fitted
    return (2 * mean**2 / variance, variance / (2 * mean)) if min(mean, variance) > 0 else (0.0, 1.0)


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse of a positive matrix whose rows differ much in size."""
    scale = 1 / np.sqrt(np.diag(matrix))
    return np.linalg.inv(matrix * scale[:, None] * scale) * scale[:, None] * scale


def _prepared(layout: Layout, threshold: float) -> ArrangementEstimator:
    if layout.arrangement is None:
        rest = ", ".join(name for name in ESTIMATORS if name != "arrangement")
        raise InvalidInput(
            f"estimator must be one of {rest} for what is no convex body before darkness, got 'arrangement'"
        )
    noise = layout.optics.sensor
    if noise.variance < _FAINTEST**2:  # the least that a likelihood can be made of
        noise = noise.model_copy(update={"sigma": _FAINTEST})
    return ArrangementEstimator(layout.arrangement, layout.optics.shape, noise)


ARRANGEMENT = EstimatorKind(_prepared, capture_px=np.inf, exact_px=2e-3)
