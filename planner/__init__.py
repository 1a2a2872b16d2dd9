"""The analytic expert: from a scene and poses to the precision of the measurement, without an image."""

import ice_vision

ice_vision.check(__file__, "scenes", "imaging")

from typing import TYPE_CHECKING

from imaging.blurred.whole import image
from imaging.features.measurand import required_edges
from imaging.features.projected_edges import projected_edges
from imaging.pictures import Pictures
from imaging.pose_scatter import pose_scatter
from planner.constraints import Constraints
from planner.forecast import Forecast
from planner.prediction import EdgePrediction, Prediction, predict, variances

if TYPE_CHECKING:
    from planner.board_places import BoardPlan, place_board
    from planner.budgeting.budgets import SceneBudget, budget
    from planner.budgeting.bundles import BundleBudget, bundle_budget
    from planner.budgeting.plans import CapabilityPlan, plan_capability
    from planner.bundle_plans import BundlePlan, BundleSet, plan_bundle
    from planner.bundles import BundlePrediction, predict_bundle
    from planner.certifying.certificate import Certificate, certified
    from planner.certifying.installation import InstallationBox, installation_box
    from planner.combining import Combination, combine
    from planner.covering import Coverage, coverage
    from planner.design import Choice, Chosen, Varied, with_choice
    from planner.maps import Map, pose_map, variance_map
    from planner.planning import NothingMeasuresAll, Plan, plan
    from planner.robustness import Robust, Tolerances, robust
    from planner.search.candidates import Candidate
    from planner.search.exhaustive import exhaustive
    from planner.search.grid import ViewingSpace
    from planner.search.objective import Aim
    from planner.view_sets import View, Views, ViewSet
    from planner.views import plan_views

_LATER = {
    "Combination": "combining", "combine": "combining",
    "Coverage": "covering", "coverage": "covering",
    "Choice": "design", "Chosen": "design", "Varied": "design", "with_choice": "design",
    "Map": "maps", "pose_map": "maps", "variance_map": "maps",
    "NothingMeasuresAll": "planning", "Plan": "planning", "plan": "planning",
    "Robust": "robustness", "Tolerances": "robustness", "robust": "robustness",
    "Candidate": "search.candidates",
    "exhaustive": "search.exhaustive",
    "ViewingSpace": "search.grid",
    "Aim": "search.objective",
    "View": "view_sets", "Views": "view_sets", "ViewSet": "view_sets",
    "plan_views": "views",
    "BoardPlan": "board_places", "place_board": "board_places",
    "BundleBudget": "budgeting.bundles", "SceneBudget": "budgeting.budgets", "budget": "budgeting.budgets",
    "bundle_budget": "budgeting.bundles", "CapabilityPlan": "budgeting.plans", "plan_capability": "budgeting.plans",
    "BundlePlan": "bundle_plans", "BundleSet": "bundle_plans", "plan_bundle": "bundle_plans",
    "BundlePrediction": "bundles", "predict_bundle": "bundles",
    "Certificate": "certifying.certificate", "certified": "certifying.certificate",
    "InstallationBox": "certifying.installation", "installation_box": "certifying.installation",
}  # fmt: skip

__getattr__, __dir__ = ice_vision.later(__name__, _LATER)  # searches load in 0.1 s, statistics in 0.3

__all__ = [
    "Aim",
    "BoardPlan",
    "BundleBudget",
    "BundlePlan",
    "BundlePrediction",
    "BundleSet",
    "Candidate",
    "CapabilityPlan",
    "Certificate",
    "Choice",
    "Chosen",
    "Combination",
    "Constraints",
    "Coverage",
    "EdgePrediction",
    "Forecast",
    "InstallationBox",
    "Map",
    "NothingMeasuresAll",
    "Pictures",
    "Plan",
    "Prediction",
    "Robust",
    "SceneBudget",
    "Tolerances",
    "Varied",
    "View",
    "ViewSet",
    "ViewingSpace",
    "Views",
    "budget",
    "bundle_budget",
    "certified",
    "combine",
    "coverage",
    "exhaustive",
    "image",
    "installation_box",
    "place_board",
    "plan",
    "plan_bundle",
    "plan_capability",
    "plan_views",
    "pose_map",
    "pose_scatter",
    "predict",
    "predict_bundle",
    "projected_edges",
    "required_edges",
    "robust",
    "variance_map",
    "variances",
    "with_choice",
]  # fmt: skip
