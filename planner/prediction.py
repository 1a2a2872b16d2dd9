"""Predicted precision of one setting, or of many at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from imaging.features.measurand import measurand, measurands, normals
from imaging.features.propagation import corner_covariance
from imaging.geometry.projection import jacobian_ideal
from imaging.models import DEFAULT_MODEL, ModelName, variance_model
from imaging.models.bias import bias, cluttered
from imaging.models.errors import Errors
from imaging.models.form_law import FormLaw, form_law
from imaging.models.texture import texture_errors
from imaging.pictures import Pictures
from planner.forecast import Forecast, forecasts, worst
from planner.ranks import edge_ranks
from planner.search.objective import DEFAULT_OBJECTIVE, Objective, minimised
from scenes import Centre, Corner, InvalidInput, Picture, Scene, Unit, Wall
from scenes.measurands.features import place_of
from scenes.measurands.form import forms_of
from scenes.results import Shown
from scenes.status import GLANCED, OK, WORST_FIRST
from scenes.units import in_unit

__all__ = ["DEFAULT_OBJECTIVE", "EdgePrediction", "Objective", "Prediction", "minimised", "predict", "variances"]


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


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Shown):
    """How precisely one setting will let the scene's quantities be measured.

    ``measurands`` tells of all of them; the other attributes of the first, where nothing else is said.

    Attributes
    ----------
    model : str
        ``paper``, ``calibrated`` or ``bound``.
    kind : str
        ``distance``, ``width``, ``offset``, ``angle``, ``diameter``, ``taper`` or ``position``.
    value_image, value_object : float
        The measurand itself, as the model projects it and in the object: px and the scene's unit, or degrees.
    variance_image, variance_object : float
        Variance (not sigma): px^2 and unit^2, or degrees^2; infinite, with the reason in `status`, where it
        cannot be measured. The ``paper`` model is right only up to one factor common to all settings, and infinite
        only where an edge is hidden or without any contrast.
    bias_image : float
        Value that the classic locators (``gradient``; ``canny`` nearly) find without noise, less `value_image`; px, or
        degrees. NaN where it is not known. 0 for the ``bound``, which is about unbiased estimators. Statistical
        textures add that of the part that their seeds roll; `Forecast` has its variance over parts.
    corners : ndarray, shape (2, 2)
        Its two features (x, y), px; (0, 0) is the centre of the first pixel. For an edge, a point on its line; one
        feature twice.
    covariances : ndarray, shape (2, 2, 2)
        Covariance of each feature, px^2; NaN for an edge.
    edges : tuple of EdgePrediction
        The straight edges of all quantities.
    status : str
        The worst of all quantities:
        ``ok``, ``clutter``, ``not_visible``, ``low_contrast``, ``short`` or ``ill_conditioned``. ``clutter``: the bias
        is above a quarter of sigma, or something too near for it to be trusted; not said of the ``bound``.
        ``glanced``: the same as ``ok``, but nobody has looked for a bias.
    measurands : tuple of Forecast
        One for each quantity.
    covariance, covariance_object : ndarray, shape (M, M)
        Joint covariance of all quantities in the image and in the object; infinite on the diagonal, NaN beside it,
        where a quantity cannot be measured.
    picture : Picture
        What it is predicted for.
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
    measurands: tuple[Forecast, ...]
    covariance: np.ndarray
    covariance_object: np.ndarray
    picture: Picture

    @property
    def units(self) -> Unit:
        """The scene's unit of length."""
        return self.picture.scene.units

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

    @property
    def limiting(self) -> str | None:
        """Name of the quantity whose standard deviation is largest against its tolerance; None without tolerances."""
        known = [(each.ratio, each.name) for each in self.measurands if each.ratio is not None]
        return max(known)[1] if known else None

    @property
    def worst_ratio(self) -> float | None:
        """That ratio."""
        return max((each.ratio for each in self.measurands if each.ratio is not None), default=None)

    @property
    def forms(self) -> dict[str, FormLaw]:
        """Of each form that can be measured, by name, the law of its points' errors, and of the zone that they make of
        a perfect feature, the scene's unit (`FormLaw.noise`)."""
        pictures, quantities = Pictures.of(self.picture), forms_of(self.picture.scene.quantities)
        laws = {quantity.name: form_law(pictures, quantity) for quantity in quantities}
        return {name: law for name, law in laws.items() if law is not None}

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a quantity: scene and poses (`Picture.row`), and what is told of it (`Forecast.as_row`)."""
        return [self.picture.row | each.as_row() for each in self.measurands]

    @property
    def told(self) -> str:
        """The quantity, or the worst of several, in one line."""
        if len(self.measurands) == 1:
            return self.measurands[0].told
        ratio, count = self.worst_ratio, len(self.measurands)
        worst = "" if ratio is None else f", sigma up to {ratio:.3g} of its tolerance ({self.limiting})"
        return f"{count} measurands{worst}, {self.status}"

    def _line(self) -> str:
        return f"{self.model}: {self.told}"


def variances(
    scene: Scene, sensors: Any, lights: Any, model: ModelName = DEFAULT_MODEL, objective: Objective = DEFAULT_OBJECTIVE
) -> np.ndarray:
    """Variance of the measurand, or what is minimised of several, for arrays of settings.

    Parameters
    ----------
    scene : Scene
    sensors, lights : array_like, shape (..., 2)
        Poses (polar, azimuth) in degrees, broadcast against each other.
    model : {"calibrated", "paper", "bound"}
    objective : {"object", "image"}
        On the plane of the features in the object (the scene's unit squared) or in the image (px^2); degrees^2 for an
        angle. Of several measurands the largest squared ratio of a standard deviation to its tolerance.

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
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    model: ModelName = DEFAULT_MODEL,
    *,
    closely: bool = True,
    roughly: bool = False,
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
    closely : bool
        Whether edges' surroundings and rims of circles are looked at closely (up to seconds on parts of many edges), or
        glanced at as by the search of `plan`: biases are then NaN, and ``glanced`` is said for ``ok``.
    roughly : bool
        Whether a close look takes the light between faces from few rays, as ``ice new`` does to choose a setting:
        several times faster, and now and then another status.

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
    scene, pictures = picture.scene, _looked_at(picture, roughly) if closely else glanced(picture)
    evaluated, known = variance_model(model)(pictures), measurand(pictures)
    glance = not closely and model != "bound"
    biased, off, clutter = _unknown(evaluated) if glance else _of_locator(pictures, model)
    textures = texture_errors(pictures)
    if textures is not None and model != "bound":
        biased = tuple(each + shift for each, shift in zip(biased, textures.shifts, strict=True))
    told = forecasts(scene, evaluated, clutter, biased, textures and textures.variances)
    edges = _edges(evaluated, clutter, off)
    if glance:
        told, edges = (tuple(map(_glanced_at, each)) for each in (told, edges))
    covariance, covariance_object = (evaluated.jointly(in_object=each) for each in (False, True))
    first = ("kind", "value_image", "value_object", "variance_image", "variance_object", "bias_image")
    return Prediction(
        model=model,
        **{name: getattr(told[0], name) for name in first},
        corners=known.points,
        covariances=feature_covariances(pictures, evaluated),
        edges=edges,
        status=worst(told),
        measurands=told,
        covariance=covariance,
        covariance_object=covariance_object,
        picture=picture,
    )


def _edges(evaluated: Errors, clutter: np.ndarray, off: np.ndarray) -> tuple[EdgePrediction, ...]:
    """The straight edges of one picture, which of them are cluttered (E,), and biases of their lines (E, 2)."""
    view, ranks = evaluated.measurands.view, edge_ranks(evaluated, clutter)
    rows = zip(view.names, view.lengths, evaluated.contrast, ranks, off, strict=True)
    return tuple(
        EdgePrediction(name, float(length), float(step), WORST_FIRST[rank], tuple(line.tolist()))
        for name, length, step, rank, line in rows
    )


def _unknown(evaluated: Errors) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray, np.ndarray]:
    """What `_of_locator` gives, where nobody has looked: NaN, and no clutter."""
    edges, none = len(evaluated.measurands.view.names), np.full(len(evaluated.measurands.quantities), np.nan)
    return (none, none), np.full((edges, 2), np.nan), np.zeros(edges, bool)


def _glanced_at(told: Any) -> Any:
    """A forecast, or an edge's: what would be ``ok`` may be another thing at a close look."""
    return replace(told, status=GLANCED) if told.status == OK else told


def _looked_at(picture: Picture, roughly: bool) -> Pictures:
    pictures = Pictures.of(picture)
    return pictures.once("roughly", lambda: replace(pictures, roughly=True, _known={})) if roughly else pictures


def glanced(picture: Picture) -> Pictures:
    """One picture to be glanced at, as the search does with many; one object for equal pictures."""
    return Pictures.of(picture).glanced


def _of_locator(pictures: Pictures, model: str) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray, np.ndarray]:
    """Biases of the quantities in image and object (M,), of the lines (E, 2), and which edges are cluttered (E,)."""
    if model == "bound":
        known = measurands(pictures)
        edges, none = len(known.view.names), np.zeros(len(known.quantities))
        return (none, none), np.zeros((edges, 2)), np.zeros(edges, bool)
    found = bias(pictures)
    return (found.values, found.values_object), found.lines, cluttered(pictures)


def feature_covariances(pictures: Pictures, evaluated: Errors, number: int = 0) -> np.ndarray:
    """Covariances of a quantity's two features, px^2, shape (2, 2, 2); NaN of an edge, one feature twice."""
    known, solid = evaluated.measurands, pictures.scene.solid
    view, found = known.view, []
    for feature in (known.quantities[number].features * 2)[:2]:
        if isinstance(feature, Centre | Wall):
            circle = solid.round(place_of(feature))
            slope = jacobian_ideal(circle.centre[None], pictures.sensors, pictures.scene.camera)[0]
            slope = slope @ np.stack(known.seen.sideways(circle), -1)
            whole = evaluated.circles[known.circles.index(circle.name)][:2, :2]
            found.append(slope @ whole @ slope.T if np.isfinite(whole).all() else np.diag([np.inf, np.inf]))
        elif isinstance(feature, Corner):
            found.append(_corner_covariance(feature, view, solid, evaluated))
        else:
            found.append(np.full((2, 2), np.nan))
    return np.stack(found)


def _corner_covariance(feature: Corner, view, solid, evaluated: Errors) -> np.ndarray:
    index = [view.names.index(name) for name in feature.edges]
    vertex = solid.vertex_names.index(feature.vertex)
    last = np.array([solid.edge(name).ends[1] == vertex for name in view.names])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        offsets = evaluated.line_variance(np.ones(len(view.names)), np.where(last, view.lengths, 0.0))
    offsets = np.where(np.isfinite(offsets) & view.visible, offsets, np.inf)
    return corner_covariance(normals(view)[index], offsets[index])
