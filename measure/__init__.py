"""An image becomes edge points, lines, corners and a distance, each with its covariance and a status."""

from measure.bound import bound, image_bound
from measure.conic import Ellipse, find_ellipse, fit_ellipse
from measure.distance import Measurement, distance
from measure.estimators import ESTIMATORS
from measure.footprint import footprint
from measure.lens import Lens, load_lens
from measure.photo import Quadrilateral, Quantity, measure_quadrilateral
from measure.propagate import Propagated, propagate
from measure.relations import line_angle, point_distance

__all__ = [
    "ESTIMATORS", "Ellipse", "Lens", "Measurement", "Propagated", "Quadrilateral", "Quantity", "bound", "distance",
    "find_ellipse", "fit_ellipse", "footprint", "image_bound", "line_angle", "load_lens", "measure_quadrilateral",
    "point_distance", "propagate",
]  # fmt: skip
