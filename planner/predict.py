"""Predicted precision of one setting, or of many at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from planner import prices
from planner.locator import MIN_CONTRAST, MIN_USABLE
from scenes import InvalidInput, Scene

Price = Literal["paper", "calibrated", "bound"]
_PRICES = {"paper": prices.paper, "calibrated": prices.calibrated, "bound": prices.bound}
_MIN_SINE = 0.02  # edges meeting at less than about a degree give a corner that no linear propagation describes


@dataclass(frozen=True)
class EdgePrediction:
    """A required edge as the sensor will see it: image length (px), contrast (rms along it, grey levels), status."""

    name: str
    length_px: float
    contrast: float
    status: str


@dataclass(frozen=True)
class Prediction:
    """How precisely one setting will let the distance be measured.

    Attributes
    ----------
    price : str
        ``paper``, ``calibrated`` or ``bound``.
    value_px : float
        The distance itself, as the model projects it, px.
    variance_px2 : float
        Variance (not sigma) of the measured distance, px^2; infinite, with the reason in `status`, where it
        cannot be measured. The ``paper`` price is right only up to one factor common to all settings, and infinite
        only where an edge is hidden or without any contrast.
    corners : ndarray, shape (2, 2)
        Start and end corner (x, y), px; (0, 0) is the centre of the first pixel.
    covariances : ndarray, shape (2, 2, 2)
        Covariance of each corner, px^2.
    edges : tuple of EdgePrediction
    status : str
        ``ok``, ``not_visible``, ``low_contrast``, ``short`` or ``ill_conditioned``.
    """

    price: str
    value_px: float
    variance_px2: float
    corners: np.ndarray
    covariances: np.ndarray
    edges: tuple[EdgePrediction, ...]
    status: str


def variances(scene: Scene, sensors: Any, lights: Any, price: Price = "calibrated") -> np.ndarray:
    """Variance of the measured distance for arrays of settings, px^2.

    Parameters
    ----------
    scene : Scene
    sensors, lights : array_like, shape (..., 2)
        Poses (polar, azimuth) in degrees, broadcast against each other.
    price : {"calibrated", "paper", "bound"}

    Returns
    -------
    ndarray, shape (...)
        Infinite where the distance cannot be measured.

    Examples
    --------
    >>> import scenes
    >>> task1 = scenes.load("task1")
    >>> v = variances(task1, [30, 135], [[15, 315], [60, 255]], "paper")
    >>> round(float(v[1] / v[0]), 1)  # the paper's Table 3: 0.595 / 0.070 = 8.5
    9.0
    """
    return _evaluate(scene, price)(scene, sensors, lights).variance


def predict(scene: Scene, sensor: Any, light: Any, price: Price = "calibrated") -> Prediction:
    """Predict the precision of one setting.

    Parameters
    ----------
    scene : Scene
    sensor, light : Pose or pair of float
        Polar angle and azimuth, degrees.
    price : {"calibrated", "paper", "bound"}
        ``calibrated`` is absolute; ``paper`` follows the paper and has a free scale; ``bound`` is what no
        unbiased estimator can beat.

    Raises
    ------
    InvalidInput
        If a pose is no pose or lies in or on the object, or the price is unknown.

    Examples
    --------
    >>> import scenes
    >>> p = predict(scenes.load("task1"), (30, 135), (15, 315))
    >>> p.status, round(p.value_px, 1), 1e-4 < p.variance_px2 < 1.3e-4
    ('ok', 100.8, True)
    """
    sensor, light = scene.check_pose("sensor", sensor), scene.check_pose("light", light)
    priced = _evaluate(scene, price)(scene, list(sensor), list(light))
    edges = tuple(
        EdgePrediction(name, float(length), float(step), _edge_status(scene, seen, usable, step))
        for name, length, usable, step, seen in zip(
            priced.view.names,
            priced.view.lengths,
            priced.view.usable,
            priced.contrast,
            priced.view.visible,
            strict=True,
        )
    )
    return Prediction(
        price=price,
        value_px=float(np.linalg.norm(priced.ends[1] - priced.ends[0])),
        variance_px2=float(priced.variance),
        corners=priced.ends,
        covariances=priced.covariances,
        edges=edges,
        status=_status(priced, edges),
    )


def _evaluate(scene: Scene, price: str):
    if price not in _PRICES:
        raise InvalidInput(f"price must be one of {', '.join(get_args(Price))}, got {price!r}")
    return _PRICES[price]


def _edge_status(scene: Scene, visible: bool, usable: float, step: float) -> str:
    if not visible or not np.isfinite(usable):
        return "not_visible"
    if not step > MIN_CONTRAST * np.sqrt(scene.noise.variance):
        return "low_contrast"
    return "short" if usable < MIN_USABLE else "ok"


def _status(priced: prices.Priced, edges: tuple[EdgePrediction, ...]) -> str:
    for worst in ("not_visible", "short", "low_contrast"):
        if any(edge.status == worst for edge in edges):
            return worst
    ends = priced.view.ends
    along = (ends[:, 1] - ends[:, 0]) / priced.view.lengths[:, None]
    sines = [abs(np.linalg.det(along[pair])) for pair in (slice(0, 2), slice(2, 4))]
    return "ill_conditioned" if min(sines) < _MIN_SINE else "ok"
