"""Values of several pictures by what can be relied on, and else by what is seen with a bias."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.bundles.biases import FeatureBias, doubts
from imaging.bundles.bundle import Bundle, BundleAdjustment, lost
from imaging.bundles.left_open import left_open
from scenes import status

_UNSEEN = "no picture shows a datum that it needs, which is known by the drawing alone"


@dataclass(frozen=True, eq=False)
class Preferred:
    """Each value of the first adjustment that tells it, of M.

    Attributes
    ----------
    good : BundleAdjustment
        Of lines and circles that are ``ok``.
    every : BundleAdjustment
        Of all that have a place.
    by_good, by_every : ndarray of bool, shape (M,)
        Which values each tells: no datum that a value needs is known by the drawing alone.
    """

    good: BundleAdjustment
    every: BundleAdjustment
    by_good: np.ndarray
    by_every: np.ndarray

    @classmethod
    def of(
        cls,
        bundle: Bundle,
        errors: Sequence[np.ndarray],
        states: Sequence[np.ndarray],
        doubts: Sequence[np.ndarray] | None = None,
    ) -> Preferred:
        """Of lines and circles of covariances (q, q) and statuses (E + C,) in each picture, and covariances (q, q) of
        what is not sure of biases that are taken off; ``misfit`` has no place."""
        held = [status.OK, status.CLUTTER, status.GLANCED, status.TONE_UNKNOWN]
        found = []
        for some in ([status.OK], held):
            counts = [np.isin(each, some) for each in states]
            parts = [seen.counted(each) for seen, each in zip(bundle.seen, counts, strict=True)]
            found += [bundle.adjusted(errors, parts, doubts), _measured(bundle, np.any(counts, 0))]
        good, of_good, every, of_every = found
        return cls(good, every, good.is_told & of_good, every.is_told & of_every)

    def statuses(self, states: Sequence[np.ndarray]) -> tuple[str, ...]:
        """Of the values: ``ok``, ``clutter`` where one needs what is, ``unplaced`` where the pictures leave it open; or
        what one of its features has in the picture that sees it best."""
        seen = self.every.bundle.seen[0]
        best = {
            name: _mildest(each)
            for name, each in zip((*seen.names, *seen.circles), zip(*states, strict=True), strict=True)
        }
        told = []
        for m, quantity in enumerate(self.every.bundle.quantities):
            untold = status.worst(status.UNPLACED, *(best[name] for name in quantity.edges))
            told.append(status.OK if self.by_good[m] else status.CLUTTER if self.by_every[m] else untold)
        return tuple(told)

    @property
    def placed_by(self) -> BundleAdjustment:
        """The adjustment that tells where part and sensors are: of what is ``ok`` where that tells a value."""
        return self.good if self.by_good.any() else self.every

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why a value is not told; empty where it is."""
        return tuple("" if told else left_open(self.every, m) or _UNSEEN for m, told in enumerate(self.is_told))

    @property
    def is_told(self) -> np.ndarray:
        """Which values have one, bool (M,)."""
        return self.by_good | self.by_every

    @cached_property
    def covariance(self) -> np.ndarray:
        """Joint covariance (M, M) by noise; infinite on the diagonal of what is not told, NaN beside it."""
        return self.spread(self.every.errors)

    @cached_property
    def by_features(self) -> tuple[np.ndarray, ...]:
        """Derivatives (M, q) of the values by the lines and circles of each picture."""
        both = zip(self.good.by_features, self.every.by_features, strict=True)
        return tuple(np.where(self.by_good[:, None], good, every) for good, every in both)

    def spread(self, errors: Sequence[np.ndarray]) -> np.ndarray:
        """The same (M, M) by independent errors of lines and circles of each picture of covariances (q, q)."""
        told = zip(self.by_features, errors, strict=True)
        return lost(sum(pull @ error @ pull.T for pull, error in told), self.is_told)

    @cached_property
    def known_before(self) -> dict[str, np.ndarray]:
        """Standard uncertainties (M,) by what is not sure of the part, each sensor and datum before, by its name."""
        good, every = self.good.known_before, self.every.known_before
        return {name: np.where(self.is_told, np.where(self.by_good, good[name], every[name]), np.inf) for name in good}

    def doubts(self, biases: Sequence[FeatureBias | None]) -> dict[str, np.ndarray]:
        """Standard uncertainties (M,) by source of what is not sure of the biases that are taken off each picture's
        lines and circles; infinite of a value that needs one whose bias is not known."""
        lights = [picture.lights for picture in self.every.bundle.pictures]
        told = doubts(self.by_features, biases, lights)
        return {name: np.where(self.by_good, u, np.inf) for name, u in told.items()}

    def biased(self, biases: Sequence[FeatureBias | None]) -> tuple[np.ndarray, np.ndarray]:
        """What is taken off the values (M,) with these, to first order, and its standard uncertainty (M,)."""
        pairs = zip(self.by_features, biases, strict=True)
        off = sum((pull @ np.where(b.is_known, b.bias, 0.0) for pull, b in pairs if b), np.zeros(len(self.by_good)))
        squares = sum((u**2 for u in self.doubts(biases).values()), np.where(self.by_good, 0.0, np.inf))
        return off, np.sqrt(squares)

    @property
    def u_placed(self) -> np.ndarray:
        """Of all these together, (M,); infinite of what is not told."""
        parts = self.known_before.values()
        return np.sqrt(sum((part**2 for part in parts), np.where(self.is_told, 0.0, np.inf)))


def _measured(bundle: Bundle, seen: np.ndarray) -> np.ndarray:
    """Of which quantities, bool (M,), every datum among their edges and circles is seen in a picture, bool (E + C,)."""
    names = (*bundle.seen[0].names, *bundle.seen[0].circles)
    unseen = {name for name, there in zip(names, seen, strict=True) if not there}
    unseen &= set(bundle.unknowns.scene.placement.features)
    return np.array([not unseen.intersection(quantity.edges) for quantity in bundle.quantities])


def _mildest(states: tuple[str, ...]) -> str:
    return max(map(str, states), key=status.WORST_FIRST.index)
