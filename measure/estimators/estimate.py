"""What every estimator returns: lines in the calipers of the expected edges, with what their errors depend on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from measure.features.calipers import Caliper


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


@dataclass(frozen=True)
class Response:
    """First-order errors on one image: derivative of (level, slope) of each edge by the pixels.

    Attributes
    ----------
    estimate : Estimate
        Of that image, n = 1.
    lines : ndarray, shape (2 E, height * width)
    """

    estimate: Estimate
    lines: np.ndarray


class Estimator(Protocol):
    """An estimator prepared for one layout."""

    calipers: tuple[Caliper, ...]
    pixels: np.ndarray
    """Flat indices of the pixels that it looks at."""

    def estimate(self, images: np.ndarray) -> Estimate:
        """Lines in a stack of images, shape (n, height, width)."""

    def covariance(self, estimate: Estimate) -> np.ndarray:
        """Covariance of (level, slope) of all edges for unit noise variance, shape (n, 2 E, 2 E)."""

    def respond(self, clean: np.ndarray) -> Response:
        """Derivative of the lines by the pixels at a noise-free image."""


def scaled(unit: np.ndarray, contrast: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Covariance of (level, slope) for unit noise from that of (offset times contrast at the middle, slope of it).

    A linear estimator yields p0 + p1 t = C(t) (a + b t) to first order, t the distance from the middle of the edge;
    errors of a and b follow from those of p by dividing by the contrast, those of the level by moving to the start.

    Parameters
    ----------
    unit : ndarray, shape (2 E, 2 E)
        Covariance of (p0, p1) of all edges for unit noise variance.
    contrast : ndarray, shape (n, E)
        Contrast at the middle of each edge.
    middle : ndarray, shape (E,)
        Place of the middle along the edge, px.
    """
    edges = middle.size
    to_start = np.zeros((2 * edges, 2 * edges))
    for e in range(edges):
        to_start[2 * e : 2 * e + 2, 2 * e : 2 * e + 2] = [[1, -middle[e]], [0, 1]]
    moved = to_start @ unit @ to_start.T
    inverse = 1 / np.repeat(np.where(contrast == 0, np.nan, contrast), 2, axis=1)
    return moved * inverse[:, :, None] * inverse[:, None, :]
