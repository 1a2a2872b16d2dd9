"""What measures a circle or a curved surface from places around it: three numbers or four, by least squares."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.features.demosaiced import place_shifts
from imaging.features.sampling import sampled_places
from measure.estimators.crossing import CrossingLocator
from measure.features.optics import Optics

_NEAR = 1.0  # px: a circle that is farther from where it is expected is looked for again from there
_PASSES = 3  # what is beside the first order is hundredths of a px, and changes by a part of that
_EXPECTED = 0.5  # of the share of its expected contrast that a place in the middle shows


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

    def sampled(self, moved: np.ndarray, optics: Optics) -> np.ndarray:
        """How far outwards pixels move the crossings of a rim that lies ``moved`` outwards, both (n, m), ideal px.

        It is a sine of the place where the rim runs along their rows or columns.
        """
        there = self.places + (moved / self.gain)[..., None] * self.normals
        mixed = place_shifts(optics.colour, there, self.normals, optics.blur_px, optics.scale_px)
        return self.gain * (sampled_places(there, self.normals, optics.blur_at(self.places), optics.scale_px) + mixed)


@dataclass(frozen=True, eq=False)
class RimTool:
    """What measures a circle or a curved surface from one expected place.

    Attributes
    ----------
    locator : CrossingLocator
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
    places : ndarray, shape (m, 2)
        In the recorded image, px.
    curve : Curve, optional
        Of a circle, whose ``inward`` leaves out what depends on where it is found.
    contrast : ndarray, shape (m,), optional
        Of a step as steep as the places are expected to show, grey levels; where the light is known.
    """

    locator: CrossingLocator
    design: np.ndarray
    weights: np.ndarray
    inward: np.ndarray
    state: str
    optics: Optics
    places: np.ndarray
    curve: Curve | None = None
    contrast: np.ndarray | None = None

    def as_expected(self, valid: np.ndarray, contrast: np.ndarray) -> np.ndarray:
        """Which of the valid places (n, m) show a contrast (n, m) for which their weights were given, bool (n, m).

        Beside a place at which both sides are as bright, the light is not known well enough to tell how little is left,
        and an error there is many times what its weight allows. All are where most show less: then the light is
        another one, and the weights are as good as any.
        """
        if self.contrast is None:
            return valid
        taken = valid & (self.weights > 0)
        share = np.where(taken, contrast / np.where(self.contrast > 0, self.contrast, np.inf), np.nan)
        some = taken.any(1)
        middle = np.full(len(valid), np.nan)
        middle[some] = np.nanmedian(share[some], 1)
        return valid & ~(share < _EXPECTED * middle[:, None])

    def solve(self, fit: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """The parameters (n, p) by a least-squares map (n, p, m) from offsets (n, m) of the crossings, ideal px.

        What moves the crossings of a circle beside the first order is told where it is found.
        """
        found = np.einsum("nim,nm->ni", fit, offset + self.inward)
        for _ in range(_PASSES if self.curve else 0):
            found = np.einsum("nim,nm->ni", fit, offset + self.inward - self.beside(found))
        return found

    def beside(self, found: np.ndarray) -> np.ndarray:
        """How far outwards crossings (n, m) of circles with errors (n, p) lie beside the first order, ideal px."""
        if self.curve is None:
            return np.zeros((len(found), len(self.design)))
        near = np.nan_to_num(found)
        near = np.where(np.abs(near @ self.design.T).max(-1, keepdims=True) <= _NEAR, near, 0.0)
        second = self.curve.second_order(near)
        return second + self.curve.sampled(near @ self.design.T + second, self.optics)

    @cached_property
    def response(self):
        """Derivative of the offsets by the locator's pixels at unit contrast, (m, P)."""
        return self.locator.unit_response()

    def fit(self, valid: np.ndarray) -> np.ndarray:
        """Least-squares maps (n, p, m) from offsets at the valid places (n, m) to the parameters."""
        weights = self.weights * valid
        gram = np.einsum("nm,mi,mj->nij", weights, self.design, self.design)
        scale = np.sqrt(np.einsum("nii->ni", gram))
        good = (scale > 0).all(-1)
        scale[~good], gram[~good] = 1.0, np.eye(self.design.shape[1])
        unit = gram / (scale[:, :, None] * scale[:, None, :])
        good &= np.linalg.eigvalsh(unit)[:, 0] > 1e-8
        unit[~good] = np.eye(self.design.shape[1])
        found = np.linalg.inv(unit) / (scale[:, :, None] * scale[:, None, :])
        found = np.einsum("nij,mj,nm->nim", found, self.design, weights)
        found[~good] = np.nan
        return found


def held(places: np.ndarray, optics: Optics) -> np.ndarray:
    """Places, those outside the image held at its border: they are not taken, but a kernel needs pixels."""
    margin = optics.window_px + 4 * optics.scale_px + 1
    return np.clip(np.nan_to_num(places), margin, np.maximum(np.array(optics.shape[::-1]) - 1 - margin, margin))
