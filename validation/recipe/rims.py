"""Circles and curved surfaces at their known places: points around each, least squares through them. NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from measure.estimators import crossings
from measure.features.points import EachPoint
from measure.features.rim_fit import RimFit
from scenes import status
from validation.recipe.places import Places
from validation.recipe.sensor import Sensor


class FoundRim(NamedTuple):
    """Errors (p,) of a circle beside where it is expected, their covariance (p, p), its status, and whether it has to
    be looked for elsewhere."""

    errors: np.ndarray
    covariance: np.ndarray
    state: str
    displaced: bool


@dataclass(frozen=True, eq=False)
class RimOptics:
    """What the least squares ask of camera and locator: noise, and the lens' blur at the places, px."""

    noise_variance: float
    scale_px: float
    blur: np.ndarray | float

    def blur_at(self, places: np.ndarray) -> np.ndarray | float:
        return self.blur

    def mixed_at(self, places: np.ndarray, normals: np.ndarray) -> float:
        """Nothing: of a sensor without colour filters."""
        return 0.0


@dataclass(frozen=True, eq=False)
class Rim:
    """One circle or curved surface.

    Attributes
    ----------
    fit : RimFit
    places : Places
        Of all that is looked at; ``part`` is which are its own.
    part : slice
    signs : ndarray, shape (m,), or None
        Where the light is known, whether the picture brightens outwards.
    sensor : Sensor
    """

    fit: RimFit
    places: Places
    part: slice
    signs: np.ndarray | None
    sensor: Sensor

    def find(self, used: np.ndarray, profiles: np.ndarray) -> FoundRim:
        """In a picture, by the levels (P,) of its pixels that are read and the profiles (M, T) of all places."""
        if self.fit.state not in status.MEASURED:
            count = self.fit.design.shape[1]
            return FoundRim(np.full(count, np.nan), np.full((count, count), np.nan), self.fit.state, False)
        points = self._points(profiles[self.part, :, None])
        fit, errors, _ = self.fit.fitted(points)
        states, near = self.fit.states(points, errors)
        displaced = bool(near[0] and self.fit.is_far(errors)[0])
        return FoundRim(errors[0], self._covariance(used, fit, points), str(states[0]), displaced)

    def _points(self, profiles: np.ndarray) -> EachPoint:
        profiles = profiles * crossings.known_signs(profiles, self.signs)[:, None]
        found = crossings.located(self.places.first, *crossings.bracket(profiles), profiles)
        offset, valid, slope = (each.T for each in found)
        gain, contrast = self.places.gain[self.part], self.places.slope_to_contrast[self.part]
        return EachPoint(offset * gain, valid, contrast * slope)

    def _covariance(self, used: np.ndarray, fit: np.ndarray, points: EachPoint) -> np.ndarray:
        maps = self.fit.noise_rows(fit, points)[0]
        variance = self.sensor.variance(used[self._pixels])
        if isinstance(variance, float):
            one, other, products = self._products
            half = (maps.take(one, 1) * products) @ maps.take(other, 1).T
            return variance * (half + half.T)
        rows = self.places.responses(maps, self.part)[1]
        return (rows * variance) @ rows.T

    @cached_property
    def _pixels(self) -> np.ndarray:
        return self.places.pixels_of(self.part)

    @cached_property
    def _products(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the responses of two places to pixels where both have some: which two, each pair once, and the product,
        half of it of a place with itself."""
        rows = self.places.responses(np.eye(len(self.fit.design)), self.part)[1]
        products = rows @ rows.T
        np.fill_diagonal(products, products.diagonal() / 2)
        one, other = np.nonzero(np.triu(products))
        return one, other, products[one, other]
