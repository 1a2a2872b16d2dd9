"""What every variance model answers: the errors of lines and centres, and of the measurand that depends on them.

A model finds how well the line of every edge is known, as a function V(A, B): the variance of A d + B theta, d the
line's displacement at the edge's first end (px) and theta its rotation (rad). `features.measurand` knows A and B.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.features.circles import RimImage, rim
from imaging.features.limbs import limb_rim
from imaging.features.measurand import Measurands, measurands
from imaging.features.placing import Adjustment
from imaging.models.extremes import extremes_of, largest_moments, of_largest, with_extremes
from imaging.models.form_law import form_variances
from imaging.pictures import Pictures
from scenes import Circle, Curved, Quantity
from scenes.measurands.features import place_of

_AT_ONCE = 64  # pictures times sums of two quantities

LineVariance = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Errors:
    """Predicted errors for pictures of leading shape (...).

    Attributes
    ----------
    measurands : Measurands
        What is measured; its arrays have the sensors' leading shape.
    line_variance : callable
        (A, B) of shape (..., E) to the variance of A d + B theta of each line, px^2.
    contrast : ndarray, shape (..., E)
        Root mean square contrast along each straight edge, grey levels.
    noise_variance : ndarray, shape (..., E)
        Mean variance of the noise along each straight edge, grey levels^2.
    cut_off : ndarray of bool, shape (..., E)
        Whether the end of the sensor's scale has cut off levels of each straight edge.
    circles : tuple of ndarray, shape (..., p, p)
        Covariance of each circle's three parameters, or a cone's four, the scene's unit squared; infinite diagonal
        where it cannot be found.
    crowded : tuple of ndarray of bool, shape (...)
        Whether something disturbs most of each circle.
    left : tuple of ndarray, shape (...)
        Part of a whole turn that lies off the ends of each arc; 1 of whole circles and limbs.
    forms : tuple of ndarray, shape (...)
        Variance of each form's size, the scene's unit squared; infinite where it cannot be found.
    joint : tuple of ndarray, optional
        Variances in the image and in the object where a model finds them jointly, not edge by edge.
    """

    measurands: Measurands
    line_variance: LineVariance
    contrast: np.ndarray
    noise_variance: np.ndarray
    cut_off: np.ndarray
    circles: tuple[np.ndarray, ...]
    crowded: tuple[np.ndarray, ...]
    left: tuple[np.ndarray, ...] = ()
    forms: tuple[np.ndarray, ...] = ()
    joint: tuple[np.ndarray, np.ndarray] | None = None

    @cached_property
    def variances(self) -> np.ndarray:
        """Of all quantities in the image, px^2 (degrees^2), shape (..., M); infinite where not measurable."""
        return self.joint[0] if self.joint else _variances(self, self.measurands.gradient, self.measurands.value)

    @cached_property
    def variances_object(self) -> np.ndarray:
        """The same in the object, the scene's unit squared (degrees^2)."""
        return self.joint[1] if self.joint else _variances(self, self.gradient_object, self.measurands.value_object)

    @cached_property
    def gradient_object(self) -> np.ndarray:
        """Derivatives of the values in the object by the features' errors (..., M, q), the part's place adjusted."""
        known = self.measurands.gradient_object
        return known if self.adjustment is None else self.adjustment.gradient(known)

    @cached_property
    def adjustment(self) -> Adjustment | None:
        """Of the part's place, as this model knows the features; None where it is known."""
        placing = self.measurands.placing
        return None if placing is None else placing.adjusted(self.of_features)

    @cached_property
    def placed(self) -> np.ndarray:
        """Variances of all quantities in the object by what is not known of the part's place, (..., M); 0 where it is
        known."""
        if self.adjustment is None:
            return np.zeros(self.variances_object.shape)
        return np.einsum("...mm->...m", self.adjustment.placed(self.measurands.gradient_object))

    @cached_property
    def of_features(self) -> np.ndarray:
        """Joint covariance (..., q, q) of lines and circles, which are independent."""
        known = self.measurands
        count = len(known.view.names)
        one, none = np.ones(count), np.zeros(count)
        first, second, both = (self.line_variance(*each) for each in ((one, none), (none, one), (one, one)))
        whole = np.zeros((*np.shape(self.variances)[:-1], known.seen.count, known.seen.count))
        lost = ~known.view.visible | ~np.isfinite(both)
        for e in range(count):
            whole[..., 2 * e, 2 * e] = np.where(lost[..., e], np.inf, first[..., e])
            whole[..., 2 * e + 1, 2 * e + 1] = np.where(lost[..., e], np.inf, second[..., e])
            with np.errstate(invalid="ignore"):
                mixed = np.where(lost[..., e], 0.0, (both - first - second)[..., e] / 2)
            whole[..., 2 * e, 2 * e + 1] = whole[..., 2 * e + 1, 2 * e] = mixed
        for c, covariance in enumerate(self.circles):
            whole[..., known.seen.numbers(c), known.seen.numbers(c)] = covariance
        whole[..., known.seen.of_board, known.seen.of_board] = self._of_board
        return whole

    @cached_property
    def _of_board(self) -> np.ndarray:
        """Covariance (..., k, k) of a board's parameters by noise."""
        board = self.measurands.board
        return np.zeros((0, 0)) if board is None else board.spread(board.noise)

    def by_board(self, gradient: np.ndarray) -> np.ndarray:
        """Variance (...) that a board's noise adds to what has a gradient (..., q)."""
        pull = gradient[..., self.measurands.seen.of_board]
        return np.einsum("...i,...ij,...j->...", pull, self._of_board, pull) if pull.shape[-1] else np.zeros(())

    @property
    def variance(self) -> np.ndarray:
        """Of the first quantity in the image, shape (...)."""
        return self.variances[..., 0]

    @property
    def variance_object(self) -> np.ndarray:
        """Of the first quantity in the object, shape (...)."""
        return self.variances_object[..., 0]

    def parts(self, number: int) -> dict[str, np.ndarray]:
        """What every edge and circle that a quantity needs adds to its variance in the object, each (...).

        Errors of different edges are independent, so the parts add up to the variance; infinite where one cannot be
        found. Not of a model that finds all jointly.
        """
        needs = self.measurands.depends()[number]
        edges, circles = _parts(self, self.gradient_object[..., number, :], needs)
        names = [*self.measurands.view.names, *self.measurands.circles]
        each = [*np.moveaxis(edges, -1, 0), *circles]
        datums = self.measurands.datums
        found = {name: part for name, part, needed in zip(names, each, needs, strict=True) if needed or name in datums}
        board = {name: self.by_board(self.gradient_object[..., number, :]) for name in datums if name not in names}
        return found | board

    def jointly(self, *, in_object: bool) -> np.ndarray:
        """Joint covariance (M, M) of all quantities of one picture in the object or in the image, extremes by their
        laws; infinite where not measurable."""
        known = self.measurands
        gradient, values = (self.gradient_object, known.value_object) if in_object else (known.gradient, known.value)
        return with_extremes(known.quantities, values, gradient, self.covariance(gradient))[1]

    def covariance(self, gradient: np.ndarray) -> np.ndarray:
        """Joint covariance (..., M, M) of quantities with a gradient (..., M, q); infinite where not measurable.

        From the variances of pairs' sums, each first brought to variance 1.
        """
        single = np.stack([_variance(self, gradient[..., m, :]) for m in range(gradient.shape[-2])], -1)
        size = np.sqrt(np.where(np.isfinite(single) & (single > 0), single, 1.0))
        unit = np.moveaxis(gradient / size[..., None], -2, 0)
        whole = np.empty((*single.shape, single.shape[-1]))
        step = max(1, _AT_ONCE // max(math.prod(single.shape[:-1]), 1))
        for i in range(single.shape[-1]):
            whole[..., i, i] = single[..., i]
            for some in (slice(at, min(at + step, i)) for at in range(0, i, step)):
                both = np.moveaxis(_variance(self, unit[i] + unit[some]), 0, -1)
                whole[..., i, some] = whole[..., some, i] = (both - 2) / 2 * size[..., i, None] * size[..., some]
        lost = ~np.isfinite(single)
        either = lost[..., :, None] | lost[..., None, :]
        return np.where(either, np.where(np.eye(single.shape[-1], dtype=bool), np.inf, np.nan), whole)


def combined(
    pictures: Pictures,
    line_variance: LineVariance,
    contrast2: np.ndarray,
    noise_variance: np.ndarray | float,
    circle_covariance: Callable[[RimImage], np.ndarray],
    *,
    cut_off: np.ndarray | bool = False,
    fall_off: bool = True,
) -> Errors:
    """From the lines' and the circles' errors to those of all quantities."""
    known, solid = measurands(pictures), pictures.scene.solid
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        rims = [_outline(pictures, solid.round(name), fall_off) for name in known.circles]
        circles = tuple(circle_covariance(each) for each in rims)
    noise, cut_off = (np.broadcast_to(each, contrast2.shape) for each in (noise_variance, cut_off))
    crowded = tuple(each.crowded for each in rims)
    left = tuple(each.left for each in rims)
    forms = form_variances(pictures, known, rims)
    return Errors(known, line_variance, np.sqrt(contrast2), noise, cut_off, circles, crowded, left, forms)


def _outline(pictures: Pictures, each: Circle | Curved, fall_off: bool) -> RimImage:
    return limb_rim(pictures, each) if isinstance(each, Curved) else rim(pictures, each, fall_off=fall_off)


def _variances(errors: Errors, gradient: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Variances (..., M) of quantities of some values (..., M) with a gradient (..., M, q)."""
    needs, quantities = errors.measurands.depends(), errors.measurands.quantities
    found = np.stack([_variance(errors, gradient[..., m, :], needs[m]) for m in range(len(needs))], -1)
    for m, rows, sign in extremes_of(quantities):
        joint = errors.covariance(gradient[..., rows, :])
        if joint.ndim == 2 and np.isfinite(joint).all():
            told = of_largest(sign * values[rows], joint)[1]
        else:
            told = largest_moments(sign * values[..., rows], joint)[1]
        found[..., m] = np.where(np.isfinite(found[..., m]) & np.isfinite(told), told, np.inf)
    return found


def _variance(errors: Errors, gradient: np.ndarray, needs: np.ndarray | None = None) -> np.ndarray:
    """Variance (...) of what moves by gradient . errors; infinite where something it needs cannot be found.

    Without ``needs``, bool (E + C,), it needs whatever its gradient is not 0 for.
    """
    edges, circles = _parts(errors, gradient, needs)
    with np.errstate(invalid="ignore", over="ignore"):
        variance = edges.sum(-1)
        for each in (*circles, errors.by_board(gradient)):
            variance = variance + each
    return np.where(np.isfinite(variance), variance, np.inf)


def _parts(errors: Errors, gradient: np.ndarray, needs: np.ndarray | None) -> tuple[np.ndarray, list[np.ndarray]]:
    """What each edge (..., E) and each circle (...) adds to it, its form with it; infinite where one that it needs
    cannot be found."""
    known = errors.measurands
    edges = len(known.view.names)
    offset, tilt = gradient[..., 0 : 2 * edges : 2], gradient[..., 1 : 2 * edges : 2]
    needed = (offset != 0) | (tilt != 0)
    needed = needed if needs is None else needed | needs[:edges]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        parts = errors.line_variance(offset, tilt)
        variance = np.where(known.view.visible & np.isfinite(parts), parts, np.inf)
        lines, circles = np.where(needed, variance, 0.0), []
        for c, covariance in enumerate(errors.circles):
            pull = known.of_circle(gradient[..., None, :], c)[..., 0, :]
            needed = (pull != 0).any(-1)
            needed = needed if needs is None else needed | needs[edges + c]
            if not needed.any():
                circles.append(np.zeros(np.broadcast_shapes(pull.shape[:-1], covariance.shape[:-2])))
                continue
            moved = np.einsum("...i,...ij,...j->...", pull, covariance, pull)
            circles.append(np.where(needed, np.where(np.isfinite(moved), moved, np.inf), 0.0))
        for quantity, variance, pull in _forms(errors, gradient):
            name, own = place_of(quantity.features[0]), np.where(pull != 0, pull**2 * variance, 0.0)
            if name in known.circles:
                circles[known.circles.index(name)] = circles[known.circles.index(name)] + own
            else:
                lines[..., known.view.names.index(name)] += own
    return lines, circles


def _forms(errors: Errors, gradient: np.ndarray) -> Iterable[tuple[Quantity, np.ndarray, np.ndarray]]:
    """Each form, its variance (...), and the derivative by its size (...)."""
    pulls = np.moveaxis(gradient[..., errors.measurands.seen.of_forms], -1, 0)
    return zip(errors.measurands.seen.forms, errors.forms, pulls, strict=True)
