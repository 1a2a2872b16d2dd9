"""The analytic expert: from a scene and poses to the precision of the measurement, without an image."""

from planner.predict import EdgePrediction, Prediction, predict, variances

__all__ = ["EdgePrediction", "Prediction", "predict", "variances"]
