"""An image becomes edge points, lines, corners and a distance, each with its covariance and a status."""

from measure.bound import bound, image_bound
from measure.distance import Measurement, distance
from measure.estimators import ESTIMATORS
from measure.footprint import footprint
from measure.propagate import Propagated, propagate

__all__ = ["ESTIMATORS", "Measurement", "Propagated", "bound", "distance", "footprint", "image_bound", "propagate"]
