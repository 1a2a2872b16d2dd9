"""Values of several pictures by what can be relied on, and else by what is seen with a bias."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.bundles.bundle import Bundle, BundleAdjustment, lost
from imaging.bundles.left_open import left_open
from scenes import status


@dataclass(frozen=True, eq=False)
class Preferred:
    """Each value of the first adjustment that tells it, of M.

    Attributes
    ----------
    good : BundleAdjustment
        Of lines and circles that are ``ok``.
    every : BundleAdjustment
        Of all that have a place.
    """

    good: BundleAdjustment
    every: BundleAdjustment

    @classmethod
    def of(cls, bundle: Bundle, errors: Sequence[np.ndarray], states: Sequence[np.ndarray]) -> Preferred:
        """Of lines and circles of covariances (q, q) and statuses (E + C,) in each picture; ``misfit`` has no place."""
        held = [status.OK, status.CLUTTER, status.GLANCED, status.TONE_UNKNOWN]
        both = list(zip(bundle.seen, states, strict=True))
        good, every = (
            bundle.adjusted(errors, [seen.of_features(np.isin(each, some)) for seen, each in both])
            for some in ([status.OK], held)
        )
        return cls(good, every)

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
            told.append(status.OK if self.good.is_told[m] else status.CLUTTER if self.every.is_told[m] else untold)
        return tuple(told)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why a value is not told; empty where it is."""
        return tuple(left_open(self.every, m) for m in range(len(self.is_told)))

    @property
    def is_told(self) -> np.ndarray:
        """Which values have one, bool (M,)."""
        return self.good.is_told | self.every.is_told

    @cached_property
    def covariance(self) -> np.ndarray:
        """Joint covariance (M, M) by noise; infinite on the diagonal of what is not told, NaN beside it."""
        return self.spread(self.every.errors)

    @cached_property
    def by_features(self) -> tuple[np.ndarray, ...]:
        """Derivatives (M, q) of the values by the lines and circles of each picture."""
        both = zip(self.good.by_features, self.every.by_features, strict=True)
        return tuple(np.where(self.good.is_told[:, None], good, every) for good, every in both)

    def spread(self, errors: Sequence[np.ndarray]) -> np.ndarray:
        """The same (M, M) by independent errors of lines and circles of each picture of covariances (q, q)."""
        told = zip(self.by_features, errors, strict=True)
        return lost(sum(pull @ error @ pull.T for pull, error in told), self.is_told)

    @cached_property
    def known_before(self) -> dict[str, np.ndarray]:
        """Standard uncertainties (M,) by what is not sure of the part, each sensor and datum before, by its name."""
        good, every = self.good.known_before, self.every.known_before
        return {name: np.where(self.good.is_told, good[name], every[name]) for name in good}

    @property
    def u_placed(self) -> np.ndarray:
        """Of all these together, (M,); infinite of what is not told."""
        parts = self.known_before.values()
        return np.sqrt(sum((part**2 for part in parts), np.where(self.is_told, 0.0, np.inf)))


def _mildest(states: tuple[str, ...]) -> str:
    return max(map(str, states), key=status.WORST_FIRST.index)
