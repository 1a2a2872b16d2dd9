"""The analytic expert: from a scene and poses to the precision of the measurement, without an image."""

from planner.alternating import alternate
from planner.constraints import Constraints
from planner.exhaustive import exhaustive
from planner.jitter import PoseSpread, pose_spread
from planner.maps import variance_map
from planner.outline import outline
from planner.plan import Candidate, Plan, plan
from planner.predict import EdgePrediction, Prediction, predict, variances
from planner.quantity import required_edges
from planner.robust import Robust, Tolerances, robust
from planner.viewing import ViewingSpace, local_minima

__all__ = [
    "Candidate", "Constraints", "EdgePrediction", "Plan", "PoseSpread", "Prediction", "Robust", "Tolerances",
    "ViewingSpace", "alternate", "exhaustive", "local_minima", "outline", "plan", "pose_spread", "predict",
    "required_edges", "robust", "variance_map", "variances",
]  # fmt: skip
