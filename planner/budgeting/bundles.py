"""The uncertainty budget of every measurand of several pictures that are adjusted together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from imaging.bundles.biases import FeatureBias
from imaging.bundles.unknowns import BOARD, Axes, Cameras, Freedom, Sensors, Shape
from imaging.features.measurand import measurands
from imaging.models import DEFAULT_MODEL, variance_model
from imaging.models.bias import MOST
from imaging.pictures import Pictures
from planner.budgeting.features import Features
from planner.budgeting.sensitivities import STEP, pulled
from planner.budgeting.sources import LENS_MODE, Source, sources
from planner.budgeting.station import Station
from planner.budgeting.terms import DATUMS, MODEL, NOISE, PATTERN, Term, of_doubts, stated, still_noise
from planner.bundles import BundlePrediction, predict_bundle
from planner.uncertainty.budget import Budget
from planner.uncertainty.budget import budget as combined
from scenes import InvalidInput, Picture, Uncertain
from scenes.board import PITCH
from scenes.cameras.covariance import ORDER
from scenes.cameras.estimated import inputs

_ADJUSTED = ("part_shift", "part_tilt_deg", "board_shift", "board_tilt_deg", PITCH, "principal_point_px")
_OF_SENSORS = ("sensor_deg", "sensor_roll_deg", "sensor_distance")
_OF_CARRIERS = ("hand_eye", "stage", "turntable")


@dataclass(frozen=True, eq=False)
class BundleBudget:
    """Budgets of all measurands, and what they are made of.

    Attributes
    ----------
    prediction : BundlePrediction
    measurands : tuple of Budget
        In the scene's unit, or degrees.
    """

    prediction: BundlePrediction
    measurands: tuple[Budget, ...]

    @property
    def statuses(self) -> tuple[str, ...]:
        """Of the values: only what `scenes.status.is_trusted` has a U that may be signed."""
        return self.prediction.status

    def __iter__(self) -> Iterator[Budget]:
        return iter(self.measurands)

    def __getitem__(self, name: str) -> Budget:
        return next(each for each in self.measurands if each.name == name)


def bundle_budget(
    pictures: Sequence[Picture],
    sensors: Sensors | tuple[Sensors, ...] = "uncertain",
    *,
    shape: Shape = "in_space",
    axes: Axes = "known",
    cameras: Cameras = "one",
    biases: Sequence[FeatureBias | None] | None = None,
    p: float = 0.95,
) -> BundleBudget:
    """The uncertainty of every measurand of pictures adjusted together; one budget a measurand.

    Rows of what the adjustment knows before are ``part``, ``sensor 1``, ..., ``carrier`` (errors of hand_eye, stage and
    turntable that pictures share), ``carrier 1``, ... (each picture's own), ``camera``, ``estimated`` (what
    ``placement.camera`` asks for), ``board``, ``board pitch``, ``board points`` and ``datums``; a sensor that counts as
    known has those of its pose, with its number. Where biases are taken off, what that is not sure of (``bias by ...``)
    stands in place of the model error.

    Parameters
    ----------
    pictures, sensors, shape, axes, cameras, biases
        As of `planner.predict_bundle`.
    p : float
        Coverage probability of the expanded uncertainties.

    Raises
    ------
    InvalidInput
        If the pictures do not tell a measurand.
    """
    told = predict_bundle(pictures, sensors, shape=shape, axes=axes, cameras=cameras, biases=biases)
    for quantity, sigma, state, why in zip(told.quantities, told.sigma, told.status, told.reason, strict=True):
        if not np.isfinite(sigma):
            raise InvalidInput(f"{quantity.name} must be measurable for a budget, got {state}: {why}")
    return BundleBudget(told, budgets_of(told, sensors, p))


def budgets_of(
    told: BundlePrediction, sensors: Sensors | tuple[Sensors, ...] = "uncertain", p: float = 0.95
) -> tuple[Budget, ...]:
    """Those of what pictures tell, in its order; there is none of a value that they do not tell.

    Parameters
    ----------
    told : BundlePrediction
        As it was predicted, or measured.
    sensors, p
        As of `bundle_budget`.
    """
    given, slopes = _sources(told, Freedom(sensors).of_sensors(len(told.pictures)))
    inputs, budgets = tuple(source.as_input for source in given), []
    for m, (quantity, slope, rows) in enumerate(zip(told.quantities, slopes, _terms(told), strict=True)):
        if not np.isfinite(told.sigma[m]):
            continue
        by_name = {source.name: float(c) for source, c in zip(given, slope, strict=True)}
        by_name |= {row.name: row.sensitivity for row in rows}
        whole = (*inputs, *(row.as_input for row in rows))
        budgets.append(combined(quantity.name, told.units[m], float(told.value[m]), whole, by_name, p))
    return tuple(budgets)


def _sources(told: BundlePrediction, sensors: tuple[str, ...]) -> tuple[tuple[Source, ...], np.ndarray]:
    """What moves places in the images beside what is adjusted, and the values' derivatives by it, (M, n)."""
    found: dict[str, tuple[Source, np.ndarray]] = {}
    own = {e.name for each in told.pictures for c in each.scene.uncertainty.carriers for e in c.errors if e.own}
    for k, (picture, pull) in enumerate(zip(told.pictures, told.preferred.by_features, strict=True)):
        features = Features(Pictures.of(picture))
        here = Station.nominal(features.pictures)
        for each in sources(picture.scene):
            of_sensor = each.name.startswith(_OF_SENSORS)
            of_camera = each.name in (*ORDER, *inputs(picture.scene.placement.camera))
            of_camera = of_camera or each.name.startswith(LENS_MODE)
            adjusted = each.name.startswith(_ADJUSTED) or of_camera or (of_sensor and sensors[k] != "known")
            carried = each.name.startswith(_OF_CARRIERS) and "uncertain" in sensors
            if each.kind != "geometry" or adjusted or carried:
                continue
            step = STEP * each.scale
            ahead, behind = features.errors([each.moved(here, step), each.moved(here, -step)])
            name = f"{each.name} {k + 1}" if of_sensor or each.name in own else each.name
            slope = pulled(pull, ((ahead - behind) / (2 * step))[None])[0]
            found[name] = replace(each, name=name), found[name][1] + slope if name in found else slope
    count = len(told.quantities)
    slopes = np.stack([slope for _, slope in found.values()], -1) if found else np.zeros((count, 0))
    return tuple(source for source, _ in found.values()), slopes


def _terms(told: BundlePrediction) -> list[list[Term]]:
    """Of each quantity noise, model error, what is known before, fixed pattern, rounding, temperature; nothing of one
    that is not told."""
    scene, pattern = told.pictures[0].scene, np.zeros(len(told.quantities))
    if scene.uncertainty.fixed_pattern and (scene.noise.prnu or scene.noise.dsnu):
        each = [Pictures.of(picture) for picture in told.pictures]
        still = [variance_model(DEFAULT_MODEL)(one.with_noise(still_noise(one, measurands(one)))) for one in each]
        pattern = np.sqrt(np.diag(told.preferred.spread([np.nan_to_num(s.of_features, posinf=0.0) for s in still])))
    datums = [u**2 for name, u in told.known_before.items() if not _is_place(name)]
    before = {name: u for name, u in told.known_before.items() if _is_place(name)}
    before |= {DATUMS: np.sqrt(sum(datums, np.zeros(len(pattern)))), PATTERN: pattern}
    found = []
    for m, unit in enumerate(told.units):
        noise = float(told.sigma[m])
        if not np.isfinite(noise):
            found.append([])
            continue
        rows = [Term(NOISE, 0.0, Uncertain(sd=noise, type="A"), unit, 1.0, "noise")]
        if told.doubts is None:
            rows.append(Term(MODEL, 0.0, Uncertain(half_width=MOST * noise), unit, 1.0))
        else:
            rows += of_doubts(told.doubts, m, unit)
        rows += [Term(name, 0.0, Uncertain(sd=float(u[m])), unit, 1.0) for name, u in before.items() if u[m] > 0]
        found.append(rows + stated(scene, unit, float(told.value[m])))
    return found


def _is_place(name: str) -> bool:
    """Whether a block is the part's place, a sensor's, a carrier's, a camera's or a board's numbers, not a datum."""
    return name == "part" or name.startswith(("sensor ", "camera", "estimated", "carrier", BOARD))
