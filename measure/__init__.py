"""An image becomes edge points, lines, corners and a distance, each with its covariance and a status."""

from measure.boards.camera import CameraCalibration, calibrate_camera
from measure.boards.chessboard import Board, chessboard
from measure.bounds import bound, image_bound
from measure.estimators.registry import ESTIMATORS, best_estimator
from measure.features.conic import Ellipse, fit_ellipse
from measure.features.relations import line_angle, point_distance
from measure.find.ellipse import find_ellipse
from measure.measurands import Measurements, measure, measure_by
from measure.measurement import Measurement, distance, distances
from measure.photo.lens import Lens, load_lens
from measure.photo.quadrilateral import MeasuredValue, Quadrilateral, measure_quadrilateral
from measure.propagation import Propagated, PropagatedValues, propagate
from measure.region import region_of_interest

__all__ = [
    "ESTIMATORS",
    "Board",
    "CameraCalibration",
    "Ellipse",
    "Lens",
    "MeasuredValue",
    "Measurement",
    "Measurements",
    "Propagated",
    "PropagatedValues",
    "Quadrilateral",
    "best_estimator",
    "bound",
    "calibrate_camera",
    "chessboard",
    "distance", "distances",
    "find_ellipse",
    "fit_ellipse",
    "image_bound",
    "line_angle",
    "load_lens",
    "measure",
    "measure_by",
    "measure_quadrilateral",
    "point_distance",
    "propagate",
    "region_of_interest",
]  # fmt: skip
