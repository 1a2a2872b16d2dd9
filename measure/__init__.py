"""An image becomes edge points, lines, corners and a distance, each with its covariance and a status."""

import ice_vision

ice_vision.check(__file__, "scenes", "imaging")

from typing import TYPE_CHECKING

from measure.best import best_estimator, other_estimators
from measure.boards.charuco import charuco
from measure.boards.chessboard import Board, chessboard
from measure.boards.dots import dot_grid
from measure.boards.marker_grid import marker_grid
from measure.bounds import bound
from measure.correction import Images, correction
from measure.estimators.kinds import ESTIMATORS, EstimatorKind, mixed_estimator
from measure.features.conic import Ellipse, fit_ellipse
from measure.find.candidate import Candidate
from measure.find.ellipse import find_ellipse
from measure.find.search import find
from measure.fitting.fit import fit
from measure.fitting.result import Fit
from measure.known_bias import Correction
from measure.measurands import Measurements, corrected, measure, measure_by
from measure.measurement import Measurement, distance, distances
from measure.photo.blur_field import BlurredSides, FittedField, blurred_sides, fitted_field
from measure.photo.lens import Intrinsics, SplinedIntrinsics, load_lens
from measure.photo.mtf import EdgeResponse, mtf
from measure.photo.noise_curve import NoiseCurve, noise_curve
from measure.photo.photograph import MeasuredShape, Shapes, photograph
from measure.photo.quadrilateral import MeasuredValue, Quadrilateral, measure_quadrilateral
from measure.photon_transfer import FramePair, PhotonTransfer, photon_transfer
from measure.placement import Located, locate
from measure.propagation import Propagated, PropagatedValues, propagate
from measure.region import region_of_interest

if TYPE_CHECKING:
    from measure.boards.camera import CameraCalibration, calibrate_camera
    from measure.boards.cross_validation import Compared, compare_models
    from measure.boards.next_pose import NextBoard, next_board
    from measure.boards.projections import Difference, projection_difference
    from measure.bundling import Bundled, bundle

_LATER = {
    "CameraCalibration": "boards.camera", "calibrate_camera": "boards.camera",
    "Compared": "boards.cross_validation", "compare_models": "boards.cross_validation",
    "NextBoard": "boards.next_pose", "next_board": "boards.next_pose",
    "Difference": "boards.projections", "projection_difference": "boards.projections",
    "Bundled": "bundling", "bundle": "bundling",
}  # fmt: skip

__getattr__, __dir__ = ice_vision.later(__name__, _LATER)  # calibrations and bundles take a second to load

__all__ = [
    "ESTIMATORS",
    "BlurredSides",
    "Board",
    "Bundled",
    "CameraCalibration",
    "Candidate",
    "Compared",
    "Correction",
    "Difference",
    "EdgeResponse",
    "Ellipse",
    "EstimatorKind",
    "Fit",
    "FittedField",
    "FramePair",
    "Images",
    "Intrinsics",
    "Located",
    "MeasuredShape",
    "MeasuredValue",
    "Measurement",
    "Measurements",
    "NextBoard",
    "NoiseCurve",
    "PhotonTransfer",
    "Propagated",
    "PropagatedValues",
    "Quadrilateral",
    "Shapes",
    "SplinedIntrinsics",
    "best_estimator",
    "blurred_sides",
    "bound",
    "bundle",
    "calibrate_camera",
    "charuco",
    "chessboard",
    "compare_models",
    "corrected",
    "correction",
    "distance",
    "distances",
    "dot_grid",
    "find",
    "find_ellipse",
    "fit",
    "fit_ellipse",
    "fitted_field",
    "load_lens",
    "locate",
    "marker_grid",
    "measure",
    "measure_by",
    "measure_quadrilateral",
    "mixed_estimator",
    "mtf",
    "next_board",
    "noise_curve",
    "other_estimators",
    "photograph",
    "photon_transfer",
    "projection_difference",
    "propagate",
    "region_of_interest",
]
