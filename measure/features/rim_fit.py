"""Least squares of what is measured from places around it: a circle's three numbers, a curved surface's three or four.

NumPy alone: a recipe (`validation.recipe`) has this file.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from imaging.features.locator import MIN_CONTRAST
from imaging.features.sampling import amplitudes, shifted_by
from measure.features.points import EachPoint
from scenes import status

if TYPE_CHECKING:
    from measure.features.optics import Optics

CAPTURE = 1.0  # px from the expected rim up to which the points are as good as on it
_NEAR = 1.0  # px: a circle that is farther from where it is expected is looked for again from there
_PASSES = 3  # what is beside the first order is hundredths of a px, and changes by a part of that
_EXPECTED = 0.5  # of the share of its expected contrast that a place in the middle shows
_MIN_FOUND = 0.7  # part of the places taken at which a point must be found
_MIN_NEAR = 0.4  # the same, for the circle to be looked for where they say
_STRAY = 1.0  # px from the circle through all places at which a crossing is of another edge
_WINDOW = np.ones(5)  # places over which a contrast is averaged before an error is told from it


@dataclass(frozen=True, eq=False)
class Curve:
    """The image of a circle's rim at m places, where it is recorded.

    Attributes
    ----------
    places, normals : ndarray, shape (m, 2)
        In the recorded image, px, and unit normals there.
    gain : ndarray, shape (m,)
        Ideal px for a recorded one, across the curve.
    along : ndarray, shape (m, 2)
        Derivative of each place along its tangent by the two shifts of the centre, ideal px for the scene's unit.
    bend : ndarray, shape (m,)
        Half the curvature of the rim's image, 1 / ideal px.
    """

    places: np.ndarray
    normals: np.ndarray
    gain: np.ndarray
    along: np.ndarray
    bend: np.ndarray

    def second_order(self, found: np.ndarray) -> np.ndarray:
        """How far outwards the rim is beside the first order of the circle's errors (n, 3), ideal px, shape (n, m).

        A circle that is shifted along its tangent turns away from it.
        """
        return -self.bend * (found[:, :2] @ self.along.T) ** 2

    def sampled(self, moved: np.ndarray, optics: Optics, amplitude: np.ndarray) -> np.ndarray:
        """How far outwards pixels move the crossings of a rim that lies ``moved`` outwards, both (n, m), ideal px.

        It is a sine of the place where the rim runs along their rows or columns, of an amplitude (m, 2).
        """
        there = self.places + (moved / self.gain)[..., None] * self.normals
        return self.gain * (shifted_by(amplitude, there) + optics.mixed_at(there, self.normals))


@dataclass(frozen=True, eq=False)
class RimFit:
    """The least squares about one expected place.

    Attributes
    ----------
    design : ndarray, shape (m, p)
        Derivative of each place's offset by its p parameters, ideal px for the scene's unit.
    weights : ndarray, shape (m,)
        Of the places in the least squares: the length that each stands for, and where the light is known the squared
        contrast over the noise's variance; 0 where it is not taken.
    inward : ndarray, shape (m,)
        How far inside the rim or limb the zero crossing lies, for it is curved and its sides are uneven, ideal px.
    state : str
        ``ok``, ``clutter``, ``low_contrast`` or ``not_visible``, as far as is known before an image.
    optics : Optics
    curve : Curve, optional
        Of a circle, whose ``inward`` leaves out what depends on where it is found.
    contrast : ndarray, shape (m,), optional
        Of a step as steep as the places are expected to show, grey levels; where the light is known.
    """

    design: np.ndarray
    weights: np.ndarray
    inward: np.ndarray
    state: str
    optics: Optics
    curve: Curve | None = None
    contrast: np.ndarray | None = None

    def fitted(self, points: EachPoint) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Least-squares maps (n, p, m), errors (n, p) and the places (n, m) that they are from: of a circle about where
        it is expected those that show what is expected of them, and lie on it."""
        fit, errors = self._through(points, points.valid)
        near = ~self.is_far(errors)[:, None]
        used = np.where(near, self.as_expected(points.valid, points.contrast), points.valid)
        if not np.array_equal(used, points.valid):
            fit, errors = self._through(points, used)
        stray = used & near & self.are_stray(points.offset, errors)
        if stray.any():
            used &= ~stray
            fit, errors = self._through(points, used)
        return fit, errors, used

    def _through(self, points: EachPoint, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        fit = self.fit(used)
        return fit, self.solve(fit, points.offset)

    def is_far(self, errors: np.ndarray) -> np.ndarray:
        """Whether circles with errors (n, p) are farther from the expected one than the locator captures, bool (n,)."""
        return np.abs(_known(errors) @ self.design.T).max(-1) > CAPTURE

    def states(self, points: EachPoint, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Statuses (n,), and whether so many points are found that the circle must be where they say, or near it."""
        clear = points.contrast > MIN_CONTRAST / 2 * np.sqrt(self.optics.noise_variance)
        part = np.count_nonzero(points.valid & clear & self._taken, 1) / max(np.count_nonzero(self._taken), 1)
        determined = np.isfinite(errors).all(1)
        state = np.where(part >= _MIN_FOUND, self.state, status.LOW_CONTRAST)
        return np.where(determined, state, status.ILL_CONDITIONED), determined & (part >= _MIN_NEAR)

    def noise_rows(self, fit: np.ndarray, points: EachPoint) -> np.ndarray:
        """Derivatives (n, p, m) of the errors by what noise moves each place by at unit contrast."""
        contrast = np.where(points.valid, points.contrast, 0.0)
        smooth = np.array([np.convolve(row, _WINDOW, "same") for row in contrast]) / self._smoothed
        inverse = np.where(self._taken, 1 / np.maximum(smooth, 1e-300), 0.0)
        return _known(fit * inverse[:, None])

    def as_expected(self, valid: np.ndarray, contrast: np.ndarray) -> np.ndarray:
        """Which of the valid places (n, m) show a contrast (n, m) for which their weights were given, bool (n, m).

        Beside a place at which both sides are as bright, the light is not known well enough to tell how little is left,
        and an error there is many times what its weight allows. All are where most show less: then the light is
        another one, and the weights are as good as any.
        """
        if self.contrast is None:
            return valid
        taken = valid & self._taken
        share = np.where(taken, contrast / self._told, np.nan)
        middle = np.array([_median(row[each]) for row, each in zip(share, taken, strict=True)])
        return valid & ~(share < _EXPECTED * middle[:, None])

    def are_stray(self, offset: np.ndarray, errors: np.ndarray) -> np.ndarray:
        """Which crossings, by their offsets (n, m), are not of the circle with errors (n, p), bool (n, m).

        Where a shadow ends on a rim, its own crossing may be gone, in some noisy images alone, and that of the shadow's
        border be found, some px away. None is where the light is not known: what moves all of one side may be another.
        """
        if self.contrast is None:
            return np.zeros(offset.shape, bool)
        return np.abs(offset + self.inward - errors @ self.design.T) > _STRAY

    def solve(self, fit: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """The parameters (n, p) by a least-squares map (n, p, m) from offsets (n, m) of the crossings, ideal px.

        What moves the crossings of a circle beside the first order is told where it is found.
        """
        from_inside = offset + self.inward
        found = (fit @ from_inside[:, :, None])[:, :, 0]
        for _ in range(_PASSES if self.curve else 0):
            found = (fit @ (from_inside - self.beside(found))[:, :, None])[:, :, 0]
        return found

    def beside(self, found: np.ndarray) -> np.ndarray:
        """How far outwards crossings (n, m) of circles with errors (n, p) lie beside the first order, ideal px."""
        if self.curve is None:
            return np.zeros((len(found), len(self.design)))
        near = _known(found)
        moved = near @ self.design.T
        far = np.abs(moved).max(-1) > _NEAR
        near[far], moved[far] = 0.0, 0.0
        second = self.curve.second_order(near)
        return second + self.curve.sampled(moved + second, self.optics, self._amplitude)

    @cached_property
    def _amplitude(self) -> np.ndarray:
        """Of what sampling by pixels does at the places of a circle, px, (m, 2)."""
        return amplitudes(self.curve.normals, self.optics.blur_at(self.curve.places), self.optics.scale_px)

    def fit(self, valid: np.ndarray) -> np.ndarray:
        """Least-squares maps (n, p, m) from offsets at the valid places (n, m) to the parameters."""
        if not valid.all():
            return self._fit(valid)
        return self._of_all if len(valid) == 1 else np.broadcast_to(self._of_all, (len(valid), *self._of_all.shape[1:]))

    @cached_property
    def _of_all(self) -> np.ndarray:
        return self._fit(np.ones((1, len(self.weights)), bool))

    @cached_property
    def _taken(self) -> np.ndarray:
        """Which places are taken, bool (m,)."""
        return self.weights > 0

    @cached_property
    def _told(self) -> np.ndarray:
        """The contrast that is expected, infinite where none is, (m,)."""
        return np.where(self.contrast > 0, self.contrast, np.inf)

    @cached_property
    def _smoothed(self) -> np.ndarray:
        """Over how many places the contrast at each is averaged, (m,)."""
        return np.convolve(np.ones(len(self.weights)), _WINDOW, "same")

    def _fit(self, valid: np.ndarray) -> np.ndarray:
        weighted = self.design.T * (self.weights * valid)[:, None]
        gram = weighted @ self.design
        scale = np.sqrt(np.einsum("nii->ni", gram))
        good = (scale > 0).all(-1)
        scale[~good], gram[~good] = 1.0, np.eye(self.design.shape[1])
        scales = scale[:, :, None] * scale[:, None, :]
        unit = gram / scales
        good &= np.linalg.eigvalsh(unit)[:, 0] > 1e-8
        unit[~good] = np.eye(self.design.shape[1])
        found = np.linalg.inv(unit) / scales @ weighted
        found[~good] = np.nan
        return found


def _known(values: np.ndarray) -> np.ndarray:
    """0 where there is no number."""
    return np.where(np.isfinite(values), values, 0.0)


def _median(values: np.ndarray) -> float:
    """Of some numbers (k,), NaN of none; as `numpy.median`, which takes several times as long for a few hundred."""
    ordered = np.sort(values)
    return (ordered[(len(values) - 1) // 2] + ordered[len(values) // 2]) / 2 if len(values) else np.nan
