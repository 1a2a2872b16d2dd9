"""An estimator of a user's own: the line through an edge's points whose slope is the median of all pairs (Theil, Sen).

Its variance is that of least squares over 0.94, the efficiency of the median slope for normal errors and many points
(Sen 1968); its points come from the gradient locator.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

import measure
from measure.estimators.estimate import Estimate
from measure.estimators.gradient import gradient_locator
from measure.estimators.separate import PointEstimator, SeparateEstimator, by_points, calipers_for, thinned
from scenes import status


@dataclass(frozen=True)
class MedianEstimator(PointEstimator):
    """One edge: the median slope of all pairs of its points, and the median offset."""

    def estimate(self, images: np.ndarray, noise_variance: np.ndarray | float) -> Estimate:
        """As of `PointEstimator`, the line excepted."""
        found = super().estimate(images, noise_variance)
        points = self.locator.locate(images)
        first, second = np.triu_indices(points.offset.shape[1], 1)
        along = np.broadcast_to(points.along, points.offset.shape)
        with np.errstate(invalid="ignore", divide="ignore"):
            slopes = (points.offset[:, second] - points.offset[:, first]) / (along[:, second] - along[:, first])
        both = points.valid[:, first] & points.valid[:, second]
        slope = np.nanmedian(np.where(both, slopes, np.nan), axis=1)
        level = np.nanmedian(np.where(points.valid, points.offset - slope[:, None] * along, np.nan), axis=1)
        good = found.state[:, 0] == status.OK
        lines = (np.where(good, each, np.nan)[:, None] for each in (level, slope))
        return Estimate(*lines, *found[2:])

    def covariance(self, estimate: Estimate, images: np.ndarray) -> np.ndarray:
        """Least squares' over the efficiency."""
        return super().covariance(estimate, images) / 0.94


def _prepared(layout, threshold: float) -> SeparateEstimator:
    optics = layout.optics
    calipers = tuple(thinned(caliper, optics.scale_px) for caliper in calipers_for(layout, 4))
    parts = by_points(optics, calipers, partial(gradient_locator, optics))
    return SeparateEstimator(calipers, tuple(part and MedianEstimator(part.caliper, part.locator) for part in parts))


measure.ESTIMATORS.add("median")(measure.EstimatorKind(_prepared, capture_px=1.5, exact_px=0.01))
