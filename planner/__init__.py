"""The analytic expert: from a scene and poses to the precision of the measurement, without an image."""

from planner.budgeting.budgets import SceneBudget, budget
from planner.budgeting.plans import CapabilityPlan, plan_capability
from planner.combining import Combination, combine
from planner.features.measurand import required_edges
from planner.features.projected_edges import projected_edges
from planner.forecast import Forecast
from planner.imaging.pictures import Pictures
from planner.jitter import PoseSpread, pose_scatter, pose_spread
from planner.maps import variance_map
from planner.planning import Candidate, Plan, plan
from planner.prediction import EdgePrediction, Prediction, predict, variances
from planner.search.aim import Aim
from planner.search.alternating import alternate
from planner.search.candidates import edges_of
from planner.search.choices import Choice, with_choice
from planner.search.constraints import Constraints
from planner.search.exhaustive import exhaustive
from planner.search.robustness import Robust, Tolerances, robust
from planner.search.varied import Chosen, Varied
from planner.search.viewing import ViewingSpace, local_minima
from planner.view_sets import View, Views, ViewSet
from planner.views import plan_views

__all__ = [
    "Aim", "Candidate", "CapabilityPlan", "Choice", "Chosen", "Combination", "Constraints", "EdgePrediction",
    "Forecast", "Pictures", "Plan", "PoseSpread", "Prediction", "Robust", "SceneBudget", "Tolerances", "Varied", "View",
    "ViewSet", "ViewingSpace", "Views", "alternate", "budget", "combine", "edges_of", "exhaustive", "local_minima",
    "plan", "plan_capability", "plan_views", "pose_scatter", "pose_spread", "predict", "projected_edges",
    "required_edges", "robust", "variance_map", "variances", "with_choice",
]  # fmt: skip
