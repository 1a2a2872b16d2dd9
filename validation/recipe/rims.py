"""Circles and curved surfaces at their known places: points around each, least squares through them. NumPy alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from measure.estimators import crossings
from measure.features.points import EachPoint
from measure.features.rim_fit import RimFit
from scenes import status
from validation.recipe.places import Places, SideBySide
from validation.recipe.sensor import Seen, Sensor


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
        Its own.
    signs : ndarray, shape (m,), or None
        Where the light is known, whether the picture brightens outwards.
    sensor : Sensor
    """

    fit: RimFit
    places: Places
    signs: np.ndarray | None
    sensor: Sensor

    def find(self, seen: Seen, points: EachPoint) -> FoundRim:
        """In what is seen of a picture, by the points at its places, (1, m)."""
        if self.fit.state not in status.MEASURED:
            count = self.fit.design.shape[1]
            return FoundRim(np.full(count, np.nan), np.full((count, count), np.nan), self.fit.state, False)
        fit, errors, _ = self.fit.fitted(points)
        states, near = self.fit.states(points, errors)
        displaced = bool(near[0] and self.fit.is_far(errors)[0])
        return FoundRim(errors[0], self._covariance(seen, fit, points), str(states[0]), displaced)

    def sign(self, up: np.ndarray, near: np.ndarray) -> np.ndarray:
        """What makes the profile of each of its places positive on the darker side, (m,), by how much these rise."""
        return crossings.signs(self.signs, up[:, None], near[:, None])[:, 0]

    def _covariance(self, seen: Seen, fit: np.ndarray, points: EachPoint) -> np.ndarray:
        maps = self.fit.noise_rows(fit, points)[0]
        variance = self.sensor.variance(seen.levels[self._pixels]) if seen.variance is None else seen.variance
        if isinstance(variance, float):
            one, other, products = self._products
            half = (maps.take(one, 1) * products) @ maps.take(other, 1).T
            return variance * (half + half.T)
        rows = self.places.responses(maps)[1]
        return (rows * variance) @ rows.T

    @cached_property
    def _pixels(self) -> np.ndarray:
        return self.places.used

    @cached_property
    def _products(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the responses of two places to pixels where both have some: which two, each pair once, and the product,
        half of it of a place with itself."""
        rows = self.places.responses(np.eye(len(self.fit.design)))[1]
        products = rows @ rows.T
        np.fill_diagonal(products, products.diagonal() / 2)
        one, other = np.nonzero(np.triu(products))
        return one, other, products[one, other]


@dataclass(frozen=True, eq=False)
class Rims:
    """All circles and curved surfaces.

    Attributes
    ----------
    each : tuple of Rim
    """

    each: tuple[Rim, ...]

    def find(self, seen: Seen) -> list[FoundRim]:
        """In what is seen of a picture."""
        if not self.each:
            return []
        profiles = self._places.profiles(seen.levels)
        points = self._points(profiles[None])  # each place as an image by itself: sums then run along rows
        return [rim.find(seen, EachPoint(*(values[:, part] for values in points))) for rim, part in self._parts()]

    @cached_property
    def _places(self) -> SideBySide:
        return SideBySide(tuple(rim.places for rim in self.each))

    def _points(self, profiles: np.ndarray) -> EachPoint:
        """Points (1, M) of profiles (1, T, M)."""
        up, near = crossings.rise(profiles)[0], crossings.rise_near(profiles)[0]
        signs = np.concatenate([rim.sign(up[part], near[part]) for rim, part in self._parts()])
        offset, valid, slope = crossings.located(self._places.first, crossings.bracket(profiles * signs))
        return EachPoint(offset * self._places.gain, valid, self._places.slope_to_contrast * slope)

    def _parts(self) -> Iterator[tuple[Rim, slice]]:
        """Each with the numbers of its places."""
        start = 0
        for rim in self.each:
            stop = start + rim.places.gain.size
            yield rim, slice(start, stop)
            start = stop
