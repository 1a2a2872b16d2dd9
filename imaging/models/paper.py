"""The paper's variance model, its formulas as printed, slips repaired and noted."""

from __future__ import annotations

import numpy as np

from imaging.features.circles import fisher_circle
from imaging.features.measurand import measurands
from imaging.models.errors import Errors, combined
from imaging.models.moments import moments
from imaging.pictures import Pictures

PAPER_POINTS = 100  # points an edge (section 9.1)
PAPER_KAPPA2 = 8.697  # the paper's least-squares estimate of k (section 9.1)


def paper(pictures: Pictures) -> Errors:
    """The paper's VarianceEvaluate (Fig. 8): eq. 8-10, 7, 3, 5, 6 as printed, slips repaired.

    100 points an edge, equally spaced in space, independent errors of variance 8.697 sigma^2 / C_i^2, no fall-off
    with distance; points that are hidden do not count. In eq. 3's V(gamma) the last term is 1 / W, not the printed
    I / W (a Monte Carlo test settles it). Its unit of intensity is not printed, so the result is right up to one factor
    for all settings.
    """
    known, per_point = measurands(pictures), PAPER_KAPPA2 * pictures.scene.noise.sigma**2
    lengths = known.view.lengths
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        total, mean, spread, count = moments(pictures, known.view.names, PAPER_POINTS)
        mean, spread, weight = mean * lengths, spread * lengths**2, total / per_point
        tilt = (spread + (count - 1) / weight) / (weight * spread**2)  # eq. 4 with sigma^2 = I / (I - 1) spread

    def line_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return a**2 * (1 + tilt) / weight + (b - a * mean) ** 2 * tilt

    def found(circle) -> np.ndarray:
        return fisher_circle(circle, circle.squared / per_point, circle.counted)

    dark = pictures.scene.noise.variance
    return combined(pictures, line_variance, total / PAPER_POINTS, dark, found, fall_off=False)
