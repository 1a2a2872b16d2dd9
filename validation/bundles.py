"""Several pictures of a part measured together, as it is inspected: biases taken off, U, decisions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import measure
from planner.budgeting.bundles import budgets_of
from planner.bundles import BundlePrediction
from planner.uncertainty.conformity import Decision, decide
from scenes import Picture
from scenes.status import is_trusted
from validation import kept
from validation.remeasured import Method

if TYPE_CHECKING:
    from imaging.bundles.unknowns import Sensors


@dataclass(frozen=True, eq=False)
class InspectedBundle:
    """What pictures say of M measurands together.

    Attributes
    ----------
    found : Bundled
        Of one set of images.
    U : tuple of float or None
        Expanded uncertainties (95 %); None of what may not be signed.
    decisions : tuple of {"pass", "fail", "undecided"} or None
        By U (ISO 14253-1); None without a tolerance.
    """

    found: measure.Bundled
    U: tuple[float | None, ...]
    decisions: tuple[Decision | None, ...]


def inspect(
    shots: Sequence[tuple[np.ndarray, Picture]], sensors: Sensors, estimator: str | None = None, *, correct: bool = True
) -> InspectedBundle:
    """Measure pictures together, take off the biases that simulations of them tell, and decide.

    Parameters
    ----------
    shots : sequence of (ndarray, Picture)
        Images, shape (height, width).
    sensors, estimator
        As of `measure.bundle`.
    correct : bool
        Whether biases are simulated where lights are known; else nothing is signed.

    Notes
    -----
    Simulated are the pictures as they are said to be; those of sensors of which nothing is known, or of a part whose
    place is left to the pictures, as they are found.
    """
    found = measure.bundle(shots, sensors, estimator=estimator)
    is_lit = all(picture.lights for _, picture in shots)
    if correct and is_lit and np.isfinite(found.value).any():
        is_moved = sensors == "unknown" or shots[0][1].scene.placement.is_estimated
        there = found.pictures if is_moved else [picture for _, picture in shots]
        corrections = [kept.correction(one, Method(estimator or measure.best_estimator(one))) for one in there]
        found = measure.bundle(shots, sensors, corrections=corrections)
    return _decided(found, sensors)


def _decided(found: measure.Bundled, sensors: Sensors) -> InspectedBundle:
    known = {} if found.doubts is None else {each.name: each.U for each in budgets_of(as_told(found), sensors)}
    expanded, decisions = [], []
    for quantity, value, nominal, state in zip(found.quantities, found.value, found.nominal, found.status, strict=True):
        U, zone = known.get(quantity.name) if is_trusted(str(state)) else None, quantity.tolerance
        reach = np.inf if U is None else U
        decided = None
        if zone is not None:
            decided = decide(float(value), reach, float(nominal), zone, k=1.0, status=str(state))
        expanded.append(U)
        decisions.append(decided)
    return InspectedBundle(found, tuple(expanded), tuple(decisions))


def as_told(found: measure.Bundled) -> BundlePrediction:
    """What was measured in one set of images, as a budget takes it."""
    return BundlePrediction(
        quantities=found.quantities,
        units=found.units,
        value=found.value,
        covariance=found.covariance,
        known_before=found.known_before,
        status=tuple(map(str, found.status)),
        reason=found.reason,
        pictures=found.pictures,
        preferred=found.preferred,
        doubts=found.doubts,
    )
