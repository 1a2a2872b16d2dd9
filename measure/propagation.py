"""The sharpest prediction: the estimator's linear response on the noise-free image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from measure import status
from measure.estimators.arrangement import ArrangementEstimator
from measure.features import arranged
from measure.features.corners import corner_response
from measure.features.layout import layout_of
from measure.features.shape import prepared
from measure.measurement import DEFAULT_ESTIMATOR, PREDICTED, checked_image, distance, separation
from planner.features.measurand import measurand
from planner.imaging.pictures import Pictures
from planner.imaging.sensor import recorded
from planner.models.bias import MOST
from scenes import Picture, Scene
from scenes.arrays import picture as one_picture


@dataclass(frozen=True)
class Propagated:
    """Predicted errors of one setting.

    Attributes
    ----------
    value_px : float
        Distance measured in the noise-free image, px.
    bias_px : float
        That less the model's distance, px.
    variance_px2 : float
        Variance of the distance, px^2; infinite where `status` says it cannot be measured.
    covariance : ndarray, shape (4, 4)
        Joint covariance of start (x, y) and end (x, y), px^2.
    response : ndarray, shape (height, width)
        Derivative of the distance by each pixel, px per grey level.
    status : str
        As `measure.distance` says; ``clutter`` too where a classic locator's noise-free value is off by more than 0.3
        standard deviations for a reason that no formula knows (interreflection).
    """

    value_px: float
    bias_px: float
    variance_px2: float
    covariance: np.ndarray
    response: np.ndarray
    status: str


def propagate(
    clean: np.ndarray,
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    estimator: str = DEFAULT_ESTIMATOR,
    threshold: float | None = None,
) -> Propagated:
    """Propagate pixel noise through lines and corners to the distance.

    On the noise-free image each line is linear in small noise, and so is all that follows. With g the derivative of the
    distance by the pixels, its variance is the sum of g^2 times each pixel's noise variance; neighbouring edge points
    share pixels, and so their correlation is in g.

    Parameters
    ----------
    clean : ndarray, shape (height, width)
        Noise-free image, grey levels, not yet cut off at the end of the sensor's scale.
    scene, sensor, light, estimator, threshold
        As for `measure.distance`.
    """
    picture = Picture.of(scene, sensor, light)
    camera = picture.scene.camera
    clean, noise = recorded(picture.scene.noise, checked_image(one_picture(clean), (camera.height, camera.width)))
    noise = np.broadcast_to(noise, clean.shape).ravel()
    found = distance(clean, picture, estimator=estimator, threshold=threshold)
    if str(found.status) not in status.MEASURED:
        return _nothing(clean, str(found.status))
    layout = layout_of(picture)
    tool = prepared(layout, estimator, picture.scene.locator.thresholds[0] if threshold is None else threshold)
    if isinstance(tool, ArrangementEstimator):
        ends = arranged.corner_response(tool, layout, clean)
    else:
        response = np.concatenate([corner_response(tool.calipers, pair) for pair in layout.corners])
        ends = response @ tool.respond(clean)
    _, gradient = separation(found.corners[None])
    g = gradient[0] @ ends
    if not np.isfinite(g).all():  # an edge was only found far from its place, where another one is
        return _nothing(clean, status.ILL_CONDITIONED)
    shift, variance = float(found.value_px - measurand(Pictures.of(picture)).value), float(noise @ (g * g))
    state = str(found.status)
    if state == status.OK and estimator in PREDICTED and abs(shift) > MOST * np.sqrt(variance):
        state = status.CLUTTER
    return Propagated(
        float(found.value_px),
        shift,
        variance,
        (noise * ends) @ ends.T,
        g.reshape(clean.shape),
        state,
    )


def _nothing(clean: np.ndarray, state: str) -> Propagated:
    return Propagated(float("nan"), float("nan"), float("inf"), np.full((4, 4), np.inf), np.zeros(clean.shape), state)
