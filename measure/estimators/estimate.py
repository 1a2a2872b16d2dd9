"""What every estimator returns: lines in the calipers of the expected edges, with what their errors depend on."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from measure.features.calipers import Caliper
from measure.features.optics import Optics


class Estimate(NamedTuple):
    """Lines of E edges in n images: offset = level + slope * along, in the caliper of each edge.

    Attributes
    ----------
    level, slope : ndarray, shape (n, E)
        Offset at the start of the edge, px, and its slope.
    contrast : ndarray, shape (n, E, 2)
        Contrast at the start of the edge and its change per px of length, grey levels.
    used, rejected : ndarray of int, shape (n, E)
        Number of edge points (of pixels, for the likelihood estimators) that were used, and that were rejected.
    state : ndarray of str, shape (n, E)
        ``ok``, ``low_contrast`` or ``sign_change``.
    """

    level: np.ndarray
    slope: np.ndarray
    contrast: np.ndarray
    used: np.ndarray
    rejected: np.ndarray
    state: np.ndarray


class Estimator(Protocol):
    """An estimator prepared for one layout."""

    calipers: tuple[Caliper, ...]
    pixels: np.ndarray
    """Flat indices of the pixels that it looks at."""

    def estimate(self, images: np.ndarray) -> Estimate:
        """Lines in a stack of images, shape (n, height, width)."""

    def covariance(self, estimate: Estimate, images: np.ndarray) -> np.ndarray:
        """Covariance of (level, slope) of all edges found in the images, shape (n, 2 E, 2 E)."""

    def respond_within(self, clean: np.ndarray) -> np.ndarray:
        """Derivative of (level, slope) of each edge by `pixels` at a noise-free image, (2 E, P)."""


def noisy(rows: np.ndarray, optics: Optics, images: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Covariance of linear functions ``rows`` (k, P) of some pixels of images, (k, k) or (n, k, k).

    As `Optics.independent` takes them.
    """
    used = images.reshape(len(images), -1)[:, pixels] if optics.noise is not None else np.zeros((1, 1))
    rows, variance = optics.independent(rows, pixels, used)
    if isinstance(variance, float):
        return variance * (rows @ rows.T)
    k, (first, second) = len(rows), np.triu_indices(len(rows))
    whole = np.empty((len(images), k, k))
    whole[:, first, second] = whole[:, second, first] = variance @ (rows[first] * rows[second]).T
    return whole
