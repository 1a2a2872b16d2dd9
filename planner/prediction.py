"""Predicted precision of one setting, or of many at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from planner.features.locator import MIN_CONTRAST, MIN_USABLE
from planner.features.measurand import measurand, normals
from planner.features.propagation import corner_covariance
from planner.imaging.pictures import Pictures
from planner.models import DEFAULT_MODEL, ModelName, variance_model
from planner.models.bias import bias, cluttered
from planner.models.errors import Errors
from scenes import Corner, InvalidInput, Picture, Scene, Unit
from scenes.units import in_unit

Objective = Literal["object", "image"]
DEFAULT_OBJECTIVE: Objective = "object"
_MIN_SINE = 0.02  # edges meeting at less than about a degree give a corner that no linear propagation describes


@dataclass(frozen=True)
class EdgePrediction:
    """A required edge as the sensor will see it.

    Attributes
    ----------
    name : str
    length_px, contrast : float
        Length of its image, px, and contrast, rms along it, grey levels.
    status : str
    bias_px : tuple of float
        How far the classic locators' line is off at the edge's two ends, along the normal (-t_y, t_x), px.
    """

    name: str
    length_px: float
    contrast: float
    status: str
    bias_px: tuple[float, float]


@dataclass(frozen=True)
class Prediction:
    """How precisely one setting will let the distance or the angle be measured.

    Attributes
    ----------
    model : str
        ``paper``, ``calibrated`` or ``bound``.
    kind : str
        ``distance`` or ``angle``.
    value_image, value_object : float
        The measurand itself, as the model projects it and in the object: px and the scene's unit, or degrees.
    variance_image, variance_object : float
        Variance (not sigma): px^2 and unit^2, or degrees^2; infinite, with the reason in `status`, where it
        cannot be measured. The ``paper`` model is right only up to one factor common to all settings, and infinite
        only where an edge is hidden or without any contrast.
    bias_image : float
        Value that the classic locators (``gradient``; ``canny`` nearly) find without noise, less `value_image`; px, or
        degrees. NaN where it is not known (circles). 0 for the ``bound``, which is about unbiased estimators.
    corners : ndarray, shape (2, 2)
        Start and end feature (x, y), px; (0, 0) is the centre of the first pixel. For an angle, a point on each line.
    covariances : ndarray, shape (2, 2, 2)
        Covariance of each feature, px^2; NaN for an angle, which needs no corners.
    edges : tuple of EdgePrediction
        The straight edges.
    status : str
        ``ok``, ``clutter``, ``not_visible``, ``low_contrast``, ``short`` or ``ill_conditioned``. ``clutter``: the bias
        is above a quarter of sigma, or something too near for it to be trusted; not said of the ``bound``.
    units : str
        The scene's unit of length.
    """

    model: str
    kind: str
    value_image: float
    value_object: float
    variance_image: float
    variance_object: float
    bias_image: float
    corners: np.ndarray
    covariances: np.ndarray
    edges: tuple[EdgePrediction, ...]
    status: str
    units: Unit = "cm"

    @property
    def value_px(self) -> float:
        """The distance in the image, px."""
        return self._of_a_distance("value_px", self.value_image)

    @property
    def variance_px2(self) -> float:
        """Its variance, px^2."""
        return self._of_a_distance("variance_px2", self.variance_image)

    @property
    def variance_cm2(self) -> float:
        """Variance of the physical length, cm^2 whatever the scene's unit."""
        return self._of_a_distance("variance_cm2", self.variance_object) * in_unit(1.0, self.units, "cm") ** 2

    @property
    def bias_px(self) -> float:
        """Bias of the distance in the image, px; `measure.distance` subtracts it on request."""
        return self._of_a_distance("bias_px", self.bias_image)

    def _of_a_distance(self, name: str, value: float) -> float:
        if self.kind != "distance":
            raise InvalidInput(f"task.kind must be distance for {name}, got {self.kind!r}")
        return value


def variances(
    scene: Scene,
    sensors: Any,
    lights: Any,
    model: ModelName = DEFAULT_MODEL,
    objective: Objective = DEFAULT_OBJECTIVE,
) -> np.ndarray:
    """Variance of the measurand for arrays of settings.

    Parameters
    ----------
    scene : Scene
    sensors, lights : array_like, shape (..., 2)
        Poses (polar, azimuth) in degrees, broadcast against each other.
    model : {"calibrated", "paper", "bound"}
    objective : {"object", "image"}
        In the object (unit^2: px^2 over the squared derivative of the image's distance by the object's, both ends
        moving apart alike) or in the image (px^2); degrees^2 for an angle.

    Returns
    -------
    ndarray, shape (...)
        Infinite where it cannot be measured.

    Examples
    --------
    >>> import scenes
    >>> task1 = scenes.load("task1")
    >>> v = variances(task1, [30, 135], [[15, 315], [60, 255]], "paper", "image")
    >>> round(float(v[1] / v[0]), 1)  # the paper's Table 3: 0.595 / 0.070 = 8.5
    9.0
    """
    return minimised(variance_model(model)(Pictures.of(scene, sensors, lights)), objective)


def predict(
    scene: Scene | Picture, sensor: Any = None, light: Any = None, model: ModelName = DEFAULT_MODEL
) -> Prediction:
    """Predict the precision of one setting.

    Parameters
    ----------
    scene : Scene or Picture
    sensor, light : Pose or pair of float
        Polar angle and azimuth, degrees; not with a picture, which has its own.
    model : {"calibrated", "paper", "bound"}
        ``calibrated`` is absolute; ``paper`` follows the paper and has a free scale; ``bound`` is what no
        unbiased estimator can beat.

    Raises
    ------
    InvalidInput
        If a pose is no pose or lies in or on the object, or the model is unknown.

    Examples
    --------
    >>> import scenes
    >>> p = predict(scenes.load("task1"), (30, 135), (15, 315))
    >>> p.status, round(p.value_px, 1), 1e-4 < p.variance_px2 < 1.3e-4
    ('ok', 100.8, True)
    """
    picture = Picture.of(scene, sensor, light)
    if not picture.lights:
        raise InvalidInput("light must be a pose, got nothing")
    scene, pictures = picture.scene, Pictures.of(picture)
    evaluated, known = variance_model(model)(pictures), measurand(pictures)
    biased, off, clutter = _of_locator(pictures, model)
    edges = tuple(
        EdgePrediction(
            name,
            float(length),
            float(step),
            _edge_status(noise, seen, whole, usable, step, crowded),
            tuple(line.tolist()),
        )
        for name, length, whole, usable, step, noise, seen, crowded, line in zip(
            known.view.names,
            known.view.lengths,
            known.view.lengths - known.view.trims.sum(-1),
            known.view.usable,
            evaluated.contrast,
            evaluated.noise_variance,
            known.view.visible,
            clutter,
            off,
            strict=True,
        )
    )
    return Prediction(
        model=model,
        kind=scene.task.kind,
        value_image=float(known.value),
        value_object=float(known.value_object),
        variance_image=float(evaluated.variance),
        variance_object=float(evaluated.variance_object),
        bias_image=biased,
        corners=known.points,
        covariances=_covariances(scene, evaluated),
        edges=edges,
        status=_status(scene, evaluated, edges),
        units=scene.units,
    )


def _of_locator(pictures: Pictures, model: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Bias of the measurand and of the lines (E, 2), and which edges are cluttered (E,)."""
    if model == "bound":
        edges = len(measurand(pictures).view.names)
        return 0.0, np.zeros((edges, 2)), np.zeros(edges, bool)
    found = bias(pictures)
    return float(found.value), found.lines, cluttered(pictures)


def minimised(errors: Errors, objective: str) -> np.ndarray:
    """The variance that an objective is about (degrees^2 for an angle)."""
    return errors.variance if check_objective(objective) == "image" else errors.variance_object


def check_objective(objective: str) -> str:
    """The objective, once it is known to be one."""
    if objective not in get_args(Objective):
        raise InvalidInput(f"objective must be one of {', '.join(get_args(Objective))}, got {objective!r}")
    return objective


def _covariances(scene: Scene, evaluated: Errors) -> np.ndarray:
    """Covariances of the two features, px^2."""
    if not scene.task.corners:
        return np.full((2, 2, 2), np.nan)
    view, centres, found = evaluated.measurand.view, iter(evaluated.centres), []
    for feature in scene.task.corners:
        if not isinstance(feature, Corner):
            found.append(next(centres))
            continue
        index = [view.names.index(name) for name in feature.edges]
        vertex = scene.solid.vertex_names.index(feature.vertex)
        last = np.array([scene.solid.edge(name).ends[1] == vertex for name in view.names])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            offsets = evaluated.line_variance(np.ones(len(view.names)), np.where(last, view.lengths, 0.0))
        offsets = np.where(np.isfinite(offsets) & view.visible, offsets, np.inf)
        found.append(corner_covariance(normals(view)[index], offsets[index]))
    return np.stack(found)


def _edge_status(noise: float, visible: bool, whole: float, usable: float, step: float, crowded: bool) -> str:
    if not visible or not np.isfinite(usable) or usable < MIN_USABLE <= whole:
        return "not_visible"
    if usable < MIN_USABLE:  # first, for where nothing is left there is no contrast either
        return "short"
    if not step > MIN_CONTRAST * np.sqrt(noise):
        return "low_contrast"
    return "clutter" if crowded else "ok"


def _status(scene: Scene, evaluated: Errors, edges: tuple[EdgePrediction, ...]) -> str:
    for worst in ("not_visible", "short", "low_contrast"):
        if any(edge.status == worst for edge in edges):
            return worst
    directions = dict(zip(evaluated.measurand.view.names, normals(evaluated.measurand.view), strict=True))
    corners = [feature for feature in scene.task.corners if isinstance(feature, Corner)]
    sines = [abs(np.linalg.det([directions[name] for name in corner.edges])) for corner in corners]
    if min(sines, default=1.0) < _MIN_SINE:
        return "ill_conditioned"
    if not np.isfinite(evaluated.variance):
        return "not_visible"
    return "clutter" if any(edge.status == "clutter" for edge in edges) else "ok"
