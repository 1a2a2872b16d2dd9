"""An image becomes edge points, lines, corners and a distance, each with its covariance and a status."""

from measure.bounds import bound, image_bound
from measure.estimators.registry import ESTIMATORS
from measure.features.conic import Ellipse, find_ellipse, fit_ellipse
from measure.features.relations import line_angle, point_distance
from measure.measurement import Measurement, distance
from measure.photo.lens import Lens, load_lens
from measure.photo.quadrilateral import Quadrilateral, Quantity, measure_quadrilateral
from measure.propagation import Propagated, propagate
from measure.region import footprint

__all__ = [
    "ESTIMATORS", "Ellipse", "Lens", "Measurement", "Propagated", "Quadrilateral", "Quantity", "bound", "distance",
    "find_ellipse", "fit_ellipse", "footprint", "image_bound", "line_angle", "load_lens", "measure_quadrilateral",
    "point_distance", "propagate",
]  # fmt: skip
