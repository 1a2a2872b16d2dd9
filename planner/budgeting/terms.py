"""What adds to a measured value beside the station's inputs: pixel noise, fixed pattern, model error, temperature."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from imaging.features.measurand import Measurands, measurands
from imaging.geometry.projection import edge_points
from imaging.light.edge_sides import side_signals
from imaging.models import DEFAULT_MODEL, variance_model
from imaging.models.bias import MOST
from imaging.pictures import Pictures
from planner.budgeting.sources import Believed
from planner.forecast import Forecast
from planner.uncertainty.inputs import Input, Kind
from scenes import Centre, Noise, Scene, Uncertain

NOISE, PATTERN, MODEL, ROUNDING = "pixel noise", "fixed pattern", "model error", "rounding"
BIAS = "bias by "  # and what its correction is not sure of
TOGETHER = "telecentricity x depth"
DATUMS = "datums"  # where they lie on the part, beside where its model says
POINTS = "board points"  # where they are on the board: print, flatness
TEMPERATURE, EXPANSION = "temperature_K", "expansion_per_K"
_LOOKED = np.linspace(0.1, 0.9, 5)  # of an edge's length


@dataclass(frozen=True)
class Term(Believed):
    """One addend of a measured value.

    Attributes
    ----------
    sensitivity : float
        Derivative of the value by the input.
    kind : {"noise", "systematic"}
        Whether it differs from picture to picture, or stays.
    """

    sensitivity: float
    kind: Kind = "systematic"

    @property
    def as_input(self) -> Input:
        """The engine's."""
        return replace(super().as_input, kind=self.kind)


def terms(
    pictures: Pictures,
    forecasts: tuple[Forecast, ...],
    variances: np.ndarray,
    biases: np.ndarray | None = None,
    *,
    biased: bool,
    doubts: Mapping[str, np.ndarray] | None = None,
    together: np.ndarray | None = None,
) -> list[list[Term]]:
    """Of each of M quantities.

    Parameters
    ----------
    forecasts : tuple of Forecast
        What is predicted of the quantities.
    variances : ndarray, shape (M,)
        Of the values by pixel noise, the scene's unit squared or degrees^2.
    biases : ndarray, shape (M,), optional
        Of the values, where a noise-free picture tells them.
    biased : bool
        Whether straight edges have the classic locators' bias.
    doubts : dict of str to ndarray, shape (M,), optional
        Where biases have been taken off: standard uncertainties of that by source, in place of all bias.
    together : ndarray, shape (M,), optional
        Standard uncertainties by what two inputs do together (`planner.budgeting.products`).
    """
    known, found = measurands(pictures), []
    for m, (each, (noise, *still)) in enumerate(zip(forecasts, unbiased(pictures, variances), strict=True)):
        sigma = float(np.sqrt(variances[m]))
        rows = _of_bias(known, m, each, sigma, biases, biased) if doubts is None else of_doubts(doubts, m, each.unit)
        if together is not None and together[m] > 0:
            rows.append(Term(TOGETHER, 0.0, Uncertain(sd=float(together[m])), each.unit, 1.0))
        found.append([noise, *rows, *still])
    return found


def unbiased(pictures: Pictures, variances: np.ndarray) -> list[list[Term]]:
    """Of each of M quantities what is beside its bias: pixel noise first, datums, fixed pattern, rounding, temperature.

    ``variances``: (M,), as of `terms`.
    """
    scene, known = pictures.scene, measurands(pictures)
    pattern = _pattern(pictures, known) if scene.uncertainty.fixed_pattern else np.zeros(len(variances))
    by = DATUMS if scene.placement.board is None else POINTS
    still, found = {by: _by_datums(pictures, known), PATTERN: pattern}, []
    for m, quantity in enumerate(known.quantities):
        unit, noise = scene.unit_of(quantity), Uncertain(sd=float(np.sqrt(variances[m])), type="A")
        rows = [Term(NOISE, 0.0, noise, unit, 1.0, "noise")]
        rows += [Term(name, 0.0, Uncertain(sd=float(u[m])), unit, 1.0) for name, u in still.items() if u[m] > 0]
        found.append(rows + stated(scene, unit, float(known.value_object[m])))
    return found


def _by_datums(pictures: Pictures, known: Measurands) -> np.ndarray:
    """Standard uncertainties (M,) by what the datums are off on the part, or a board's points on it; 0 where the
    part's place is known otherwise."""
    adjustment = None if known.placing is None else variance_model(DEFAULT_MODEL)(pictures).adjustment
    if adjustment is None:
        return np.zeros(len(known.quantities))
    return np.sqrt(np.diag(adjustment.by_datums(known.gradient_object)))


def _of_bias(
    known: Measurands, m: int, each: Forecast, sigma: float, biases: np.ndarray | None, biased: bool
) -> list[Term]:
    limit = _model_error(known, m, each, sigma, biased) if biases is None else abs(float(biases[m]))
    return [Term(MODEL, 0.0, Uncertain(half_width=limit), each.unit, 1.0)]


def of_doubts(doubts: Mapping[str, np.ndarray], m: int, unit: str) -> list[Term]:
    """What is not known at all is no number: the value's status says so."""
    known = {name: float(u[m]) for name, u in doubts.items() if np.isfinite(u[m])}
    return [Term(BIAS + name, 0.0, Uncertain(sd=u), unit, 1.0) for name, u in known.items() if u > 0]


def _model_error(known: Measurands, m: int, each: Forecast, sigma: float, biased: bool) -> float:
    """Largest error of the estimator's model: the predicted bias, or where no formula tells it what `ok` allows."""
    circular = any(isinstance(feature, Centre) for feature in known.quantities[m].basic)
    if biased and not circular and np.isfinite(each.bias_object):
        return abs(each.bias_object)
    return MOST * sigma


def stated(scene: Scene, unit: str, value: float) -> list[Term]:
    """Rounding and temperature, as the scene says them."""
    said, angle = scene.uncertainty, unit == "degrees"
    step = said.rounding_deg if angle else said.rounding
    rows = [Term(ROUNDING, 0.0, Uncertain(half_width=step / 2), unit, 1.0)] if step > 0 else []
    if angle or said.expansion_per_K is None:
        return rows
    excess = said.temperature_K or Uncertain(sd=0.0)
    away, per_k = excess.value or 0.0, said.expansion_per_K.value
    rows.append(Term(TEMPERATURE, away, excess, "K", -value * per_k))
    rows.append(Term(EXPANSION, per_k, said.expansion_per_K, "1/K", -value * away))
    return rows


def _pattern(pictures: Pictures, known: Measurands) -> np.ndarray:
    """Standard uncertainty by the fixed pattern, (M,): what noise of that size does, once, and then in all pictures."""
    noise = pictures.scene.noise
    if noise.prnu == 0 and noise.dsnu == 0:
        return np.zeros(len(known.quantities))
    still = still_noise(pictures, known)
    return np.sqrt(variance_model(DEFAULT_MODEL)(pictures.with_noise(still)).variances_object)


def still_noise(pictures: Pictures, known: Measurands) -> Noise:
    """Noise as large as the fixed pattern.

    Its part that grows with the level is taken at the root mean square level beside the straight edges, or at the level
    of a white surface where there are none.
    """
    scene, noise = pictures.scene, pictures.scene.noise
    signal = scene.camera.exposure
    if known.view.names:
        sides = side_signals(pictures, known.view.names, edge_points(scene.solid, known.view.names, _LOOKED))
        signal = float(np.sqrt(np.nanmean(np.square(sides))))
    dark, bright = (noise.factor(power) for power in (2, 0))
    return Noise(
        sigma=math.sqrt(dark * noise.dsnu**2 + bright * (noise.prnu * signal) ** 2), dark_level=noise.dark_level
    )
