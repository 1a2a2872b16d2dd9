"""The uncertainty budget of every measurand of a scene, in one picture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from imaging.models.arranged import arranged_variances, is_arranged
from imaging.pictures import Pictures
from planner.budgeting.features import Features
from planner.budgeting.products import products
from planner.budgeting.sensitivities import sensitivities
from planner.budgeting.sources import LENS_MODE, Source, sources
from planner.budgeting.terms import BIAS, EXPANSION, MODEL, TEMPERATURE, Term, terms
from planner.prediction import Prediction, predict
from planner.uncertainty.budget import Budget
from planner.uncertainty.budget import budget as combined
from planner.uncertainty.groups import Group
from planner.uncertainty.groups import Source as EngineInput
from planner.uncertainty.ufloats import as_ufloats
from scenes import InvalidInput, Picture, Scene, status
from scenes.arrays import finite
from scenes.results import Shown, value

CALIBRATION = "camera calibration"


@dataclass(frozen=True, eq=False, repr=False)
class SceneBudget(Shown):
    """Budgets of all M measurands, and what they are made of.

    Attributes
    ----------
    picture : Picture
    prediction : Prediction
    sources : tuple of Source
        The n inputs that move what the picture shows.
    sensitivities : ndarray, shape (M, n)
        Derivatives of the values in the object by them.
    terms : list of list of Term
        Of each measurand, what is added beside.
    measurands : tuple of Budget
        In the scene's unit, or degrees.
    statuses : tuple of str
        Of the values: only what `scenes.status.is_trusted` has a U that may be signed.
    unsure : tuple of bool, optional
        Where biases were simulated and are taken off: of which values the bias is not known at all.
    """

    picture: Picture
    prediction: Prediction
    sources: tuple[Source, ...]
    sensitivities: np.ndarray
    terms: list[list[Term]]
    measurands: tuple[Budget, ...]
    statuses: tuple[str, ...]
    unsure: tuple[bool, ...] | None = None

    def __iter__(self) -> Iterator[Budget]:
        return iter(self.measurands)

    def __getitem__(self, name: str) -> Budget:
        return next(each for each in self.measurands if each.name == name)

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a measurand and source: scene and poses (`Picture.row`), and the source's (`Budget.as_rows`)."""
        where = self.picture.row
        return [where | {"measurand": each.name, "unit": each.unit, **row} for each in self for row in each.as_rows()]

    def _line(self) -> str:
        return "; ".join(
            f"{each.name} {value(each.value, each.U, each.unit)}, k = {each.k:.2f}"
            if status.is_trusted(state)
            else f"{each.name} not signed: {status.doubt(state)}"
            for each, state in zip(self, self.statuses, strict=True)
        )

    def ufloats(self) -> dict[str, Any]:
        """Values as numbers of the `uncertainties` package by name; they share the station's inputs and temperature.

        Noise, model error, fixed pattern and rounding are each measurand's own.
        """
        return as_ufloats(_with_own_terms(each, rows) for each, rows in zip(self, self.terms, strict=True))

    @property
    def u_bias(self) -> tuple[float, ...]:
        """Standard uncertainty of each value by its bias: what a correction is not sure of, or the model error.

        Infinite where the bias is not known.
        """
        told = (
            [row.contribution for row in each.contributions if row.source == MODEL or row.source.startswith(BIAS)]
            for each in self.measurands
        )
        unsure = self.unsure or (False,) * len(self.measurands)
        return tuple(math.inf if unknown else math.hypot(*some) for some, unknown in zip(told, unsure, strict=True))

    @cached_property
    def features(self) -> Features:
        """The lines and circles of the picture, to be found in those of other stations."""
        return Features(Pictures.of(self.picture))

    @cached_property
    def shared(self) -> tuple[EngineInput, ...]:
        """The inputs of all measurands: single ones, and the calibration's as one group."""
        return shared_inputs(self.picture.scene, self.sources)


def budget(
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    *,
    variances: np.ndarray | None = None,
    biases: np.ndarray | None = None,
    statuses: tuple[str, ...] | None = None,
    biased: bool | None = None,
    doubts: Mapping[str, np.ndarray] | None = None,
    p: float = 0.95,
) -> SceneBudget:
    """The uncertainty of every measurand in one picture: pixel noise and all that the scene says is not exact.

    Parameters
    ----------
    scene : Scene or Picture
    sensor, light : Pose or pair of float
        Polar angle and azimuth, degrees; not with a picture, which has its own.
    variances : ndarray, shape (M,), optional
        Of the values by pixel noise, the scene's unit squared or degrees^2, where a picture tells them better than the
        models do: ``calibrated`` of the classic locators, of ``arrangement`` as it knows all lines together.
    biases : ndarray, shape (M,), optional
        Of the values without noise, measured in a noise-free picture, in place of the predicted ones.
    statuses : tuple of str, optional
        Of the values in that picture, in place of the predicted ones.
    biased : bool, optional
        Whether straight edges are found by the classic locators, whose bias the planner predicts; by default where
        `measure.best_estimator` is one of them.
    doubts : dict of str to ndarray, shape (M,), optional
        Where the values' biases are found by simulation and taken off (`measure.correction`): standard uncertainties of
        that by source, the scene's unit or degrees. They stand in place of the model error.
    p : float
        Coverage probability of the expanded uncertainties.

    Raises
    ------
    InvalidInput
        If a measurand cannot be measured there.

    Examples
    --------
    >>> import scenes
    >>> task1 = scenes.load("task1")
    >>> known = scenes.Uncertainty(sensor_distance=0.1)
    >>> found = budget(task1.model_copy(update={"uncertainty": known}), (30, 135), (15, 315)).measurands[0]
    >>> [row.source for row in found.contributions]
    ['sensor_distance', 'pixel noise', 'model error']
    """
    picture = Picture.of(scene, sensor, light)
    variances, biases = (_checked(*told, picture) for told in (("variances", variances), ("biases", biases)))
    if variances is not None and variances.min() < 0:
        raise InvalidInput(f"variances must be at least 0, got {variances.min():g}")
    for name, some in (doubts or {}).items():
        if np.shape(some) != (len(picture.scene.quantities),) or not (np.asarray(some) >= 0).all():
            raise InvalidInput(f"doubts[{name!r}] must be one at least 0 for each measurand, got {some}")
    prediction = predict(picture)
    for each in prediction.measurands:
        if not np.isfinite(each.variance_object):
            raise InvalidInput(f"{each.name} must be measurable for a budget, got {each.status} in this picture")
    features = Features(Pictures.of(picture))
    biased = not is_arranged(picture.scene) if biased is None else biased
    given = sources(picture.scene)
    slopes = sensitivities(features, given, biased=biased)
    told = prediction if biased else predict(picture, model="bound")  # by the estimator that is meant
    noise = variances if variances is not None else _noise(features.pictures, told, biased=biased)
    beside = terms(features.pictures, prediction.measurands, noise, biases, biased=biased, doubts=doubts,
                   together=products(features, given))  # fmt: skip
    inputs, budgets = shared_inputs(picture.scene, given), []
    for each, slope, rows in zip(prediction.measurands, slopes, beside, strict=True):
        by_name = {source.name: float(c) for source, c in zip(given, slope, strict=True)}
        by_name |= {row.name: row.sensitivity for row in rows}
        whole = (*inputs, *(row.as_input for row in rows))
        budgets.append(combined(each.name, each.unit, each.value_object, whole, by_name, p))
    statuses = statuses or tuple(each.status for each in told.measurands)
    unsure = None if doubts is None else tuple(np.isinf(list(doubts.values())).any(0).tolist())
    return SceneBudget(picture, prediction, given, slopes, beside, tuple(budgets), statuses, unsure)


def _noise(pictures: Pictures, told: Prediction, *, biased: bool) -> np.ndarray:
    """Variances (M,) of the values by pixel noise, the scene's unit squared or degrees^2."""
    variances = np.array([each.variance_object for each in told.measurands])
    if biased or not is_arranged(pictures.scene):
        return variances
    found = arranged_variances(pictures)
    return np.where(np.isfinite(found), found, variances)


def _checked(name: str, values: Any, picture: Picture) -> np.ndarray | None:
    if values is None:
        return None
    count, numbers = len(picture.scene.quantities), finite(values, name)
    if numbers.shape != (count,):
        raise InvalidInput(f"{name} must be one for each of {count} measurands, got shape {numbers.shape}")
    return numbers


def _with_own_terms(made: Budget, rows: list[Term]) -> Budget:
    """The same budget, the terms that are its own named after it."""
    own = {row.name: f"{row.name} of {made.name}" for row in rows if row.name not in (TEMPERATURE, EXPANSION)}
    sources = tuple(replace(s, name=own[s.name]) if s.name in own else s for s in made.sources)
    slopes = {own.get(name, name): slope for name, slope in made.sensitivities.items()}
    return combined(made.name, made.unit, made.value, sources, slopes, made.p)


def shared_inputs(scene: Scene, given: tuple[Source, ...]) -> tuple[EngineInput, ...]:
    """The sources as the engine's inputs: single ones first, then those of the calibration as a group."""
    told = scene.uncertainty.covariance
    names = () if told is None else told.names
    calibrated = tuple(each for each in given if each.name in names or each.name.startswith(LENS_MODE))
    single = tuple(source.as_input for source in given if source not in calibrated)
    if not calibrated:
        return single
    correlation = np.eye(len(calibrated)) if told is None else told.correlation
    return (*single, Group(tuple(source.as_input for source in calibrated), correlation, CALIBRATION))
