"""How many pixels at the end of the sensor's scale a picture may have for a simulated bias to be its own.

A part that reflects more than its scene says, or a lamp that is nearer, makes a brighter picture. An edge is measured
at the same place in it, until levels beside the edge are cut off at the end of the scale: then it moves by what the
simulation does not know, for its picture is not, or otherwise, cut off. How many pixels are tells how bright the
picture is, whatever made it so.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import ndtr

from imaging.models.bias import MOST
from imaging.sensor import full_scale, recorded, shot_noise
from measure.quantities import find
from measure.region import region_of_interest
from scenes import Noise, Picture
from scenes.status import MEASURED

_BRIGHTER = tuple(1.02**step for step in range(1, 13))  # light over the simulated one's
_CHANCE = 3.0  # standard deviations of a count, and as many pixels, that say nothing


def saturated(images: np.ndarray, picture: Picture, estimator: str) -> np.ndarray:
    """How many of the pixels that a measurement looks at are at the end of the scale, int, shape (n,).

    Parameters
    ----------
    images : ndarray, shape (n, height, width)
        Grey levels, as recorded.
    picture : Picture
    estimator : str
        Of the straight edges.
    """
    end = _end(picture.scene.noise)
    if images.size == 0 or np.isinf(end):
        return np.zeros(len(images), int)
    return (images.reshape(len(images), -1)[:, _looked_at(picture, estimator)] >= end).sum(1)


@lru_cache(maxsize=8)
def _looked_at(picture: Picture, estimator: str) -> np.ndarray:
    """Numbers of the pixels, counted row by row."""
    return np.flatnonzero(region_of_interest(picture, estimators=(estimator,)))


def limits(
    image: np.ndarray, picture: Picture, estimator: str, threshold: float | None, sigma: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Least and most pixels at the end of the scale (`saturated`) beside which each value's bias is the simulated one.

    The simulated picture is made brighter and darker. Where a value moves by more than 0.3 of its standard deviation
    the limit is, but where chance alone makes as many pixels or as few.

    Parameters
    ----------
    image : ndarray, shape (height, width)
        The simulated noise-free one, grey levels, not yet cut off.
    estimator, threshold
        As of `measure.distance`.
    sigma : ndarray, shape (M,)
        Standard deviations of the values by noise, in the object.

    Returns
    -------
    ndarray, ndarray, shapes (M,)
        0 and infinite of a sensor whose scale has no end.
    """
    if np.isinf(full_scale(picture.scene.noise)):
        return np.zeros(len(sigma)), np.full(len(sigma), np.inf)
    looked = region_of_interest(picture, estimators=(estimator,))
    lit = _Lit(image, picture, (estimator, threshold), image[looked])
    here = lit.count(1.0)
    chance = _CHANCE * (np.sqrt(here) + 1)
    most = [max(here + chance, lit.count(by)) for by in lit.followed(sigma, _BRIGHTER)]
    least = np.zeros(len(sigma))
    if here > chance:
        darker = tuple(1 / by for by in _BRIGHTER)
        least = np.array([min(here - chance, lit.count(by)) for by in lit.followed(sigma, darker)])
    return least, np.array(most)


def expected(noise: Noise, levels: np.ndarray) -> float:
    """How many of some pixels are at the end of the scale on average, of their noise-free levels.

    Examples
    --------
    >>> round(expected(Noise(sigma=2.0, bits=8), np.array([100.0, 254.5, 300.0])), 6)
    1.5
    """
    signal = levels - noise.dark_level
    dark = noise.factor(2) * (noise.sigma**2 + noise.dsnu**2)
    variance = dark + shot_noise(noise, signal) + (noise.prnu * signal) ** 2
    return float(ndtr((levels - _end(noise)) / np.sqrt(np.maximum(variance, 1e-12))).sum())


@dataclass(frozen=True, eq=False)
class _Lit:
    """A simulated picture under more light, or less.

    Attributes
    ----------
    image : ndarray, shape (height, width)
        Noise-free, grey levels, not cut off.
    method : (str, float or None)
        Estimator, and threshold of ``canny``.
    looked : ndarray, shape (n,)
        The levels that the measurement looks at.
    """

    image: np.ndarray
    picture: Picture
    method: tuple[str, float | None]
    looked: np.ndarray

    def count(self, by: float) -> float:
        """Mean number of pixels at the end of the scale under so many times the light."""
        return expected(self.picture.scene.noise, self._levels(self.looked, by))

    def followed(self, sigma: np.ndarray, steps: tuple[float, ...]) -> np.ndarray:
        """How much light, from 1 along steps, until each value has moved by the largest bias of what is ok, (M,).

        Between two steps as if a value moved evenly; the last step where it has not moved as far.
        """
        reached, before, last = np.full(len(sigma), steps[-1]), np.zeros(len(sigma)), 1.0
        start, held = self._values(1.0), np.ones(len(sigma), bool)
        for by in steps:
            if self.count(max(by, last)) >= 1:  # below, nothing moves
                with np.errstate(divide="ignore", invalid="ignore"):
                    moved = np.abs(self._values(by) - start) / sigma
                    share = np.where(np.isfinite(moved), (MOST - before) / (moved - before), 0.0)
                over = held & ~(moved <= MOST)
                reached[over] = last + np.clip(share[over], 0.0, 1.0) * (by - last)
                held, before = held & ~over, moved
                if not held.any():
                    break
            last = by
        return reached

    def _values(self, by: float) -> np.ndarray:
        """In the object, (M,), as the sensor records it; NaN where there is none."""
        levels = recorded(self.picture.scene.noise, self._levels(self.image, by)).level
        found = find(levels[None], self.picture, *self.method)
        return np.where(np.isin(found.status[0], MEASURED), found.plane.value[0], np.nan)

    def _levels(self, levels: np.ndarray, by: float) -> np.ndarray:
        dark = self.picture.scene.noise.dark_level
        return dark + by * (levels - dark)


def _end(noise: Noise) -> float:
    """The level from which on a whole number is the last of the scale."""
    return full_scale(noise) - 0.5
