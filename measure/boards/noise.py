"""The noise of a board's picture: given, or told by what fits of its points leave."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from scipy.special import chdtri

from measure.photo.noise import noise_sigma
from scenes.arrays import BRIGHTEST
from scenes.errors import InvalidInput

_LEAST = 1e-150  # below, squares are no ordinary numbers


class Fits(Protocol):
    """Fits of n points: squared residuals and their degrees of freedom, (n,), and which have settled, bool (n,)."""

    @property
    def square(self) -> np.ndarray: ...
    @property
    def freedom(self) -> np.ndarray: ...
    @property
    def converged(self) -> np.ndarray: ...


def of_board(image: np.ndarray, given: float | None, fitted: Fits | None = None) -> float:
    """Standard deviation of a pixel's noise: given, or told by the image; at least that of rounding.

    What is printed or lies beside the points makes `noise_sigma` too large. Residuals of their fits do not know of it,
    but grow where the model fails, so the lesser one is told: a model that fails is seen as it was.
    """
    told = given or noise_sigma(image)
    if given is None and fitted is not None and fitted.converged.any():
        middle = fitted.square / chdtri(fitted.freedom, 0.5)
        told = min(told, float(np.sqrt(np.median(middle[fitted.converged]))))
    return max(float(told), least_noise(image))


def least_noise(image: np.ndarray) -> float:
    """That of rounding to whole grey levels; of numbers that are not rounded, that of the arithmetic."""
    return float(np.sqrt(1 / 12)) if (image == np.rint(image)).all() else 1e-9 * float(np.ptp(image)) + 1e-300


def check_noise(noise: Any) -> None:
    """See that a standard deviation of white noise, if given, is a number that squares are told from zero of.

    Raises
    ------
    InvalidInput
        If not.
    """
    number = isinstance(noise, int | float | np.number) and not isinstance(noise, bool)
    if noise is not None and not (number and _LEAST <= noise <= BRIGHTEST):
        raise InvalidInput(f"noise must be a number more than 0 and at most {BRIGHTEST:g}, got {noise!r}")
