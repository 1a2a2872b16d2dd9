"""An image becomes edge points, lines, corners and a distance, each with its covariance and a status."""

from measure.bound import bound
from measure.distance import LOCATORS, Measurement, distance
from measure.footprint import footprint
from measure.propagate import Propagated, propagate

__all__ = ["LOCATORS", "Measurement", "Propagated", "bound", "distance", "footprint", "propagate"]
