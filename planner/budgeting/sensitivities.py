"""What each input does to the measured values: derivatives of what a picture evaluated as the scene says would give.

A value is g(features(true station), believed scene). The features' errors by an input are central differences of the
closed-form projection over 1e-5 of the input's own size, in which 1e-9 of them is lost; g is linear in small errors,
and its derivative by them is exact (`imaging.features.kinds`). No picture is rendered. An input that changes levels
alone moves no feature; it changes the classic locators' bias, whose closed form is differenced over one standard
uncertainty to both sides. What a geometric input does to that bias, a small part of a small part, is left out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from imaging.models import DEFAULT_MODEL, variance_model
from imaging.models.bias import bias
from planner.budgeting.features import Features
from planner.budgeting.sources import Source
from planner.budgeting.station import Station
from scenes.placement import COMPONENTS

STEP = 1e-5  # of an input's scale


def sensitivities(features: Features, given: tuple[Source, ...], *, biased: bool) -> np.ndarray:
    """Derivatives of all M values in the object by n inputs, shape (M, n).

    Parameters
    ----------
    features : Features
    given : tuple of Source
    biased : bool
        Whether the values have the classic locators' bias, so that brightness counts.

    Returns
    -------
    ndarray
        The scene's unit, or degrees, for an input's unit; NaN where a quantity is not seen.
    """
    here = Station.nominal(features.pictures)
    count, left = len(features.known.quantities), _by_placement(features)
    moving = tuple(each for each in given if each.kind == "geometry" and each.name not in left)
    left |= {each.name: slope for each, slope in zip(moving, by_geometry(features, here, moving), strict=True)}
    columns = [
        left[each.name] if each.name in left else _by_brightness(here, each) if biased else np.zeros(count)
        for each in given
    ]
    return np.stack(columns, -1) if columns else np.zeros((count, 0))


def _by_placement(features: Features) -> dict[str, np.ndarray]:
    """Derivatives (M,) by the components of the part's place that the datums tell: what the adjustment leaves of them.

    A measurement takes the place as it is found for the believed one, and begins anew; so the adjustment's own
    derivatives count, not those of a picture of a part far off.
    """
    known = features.known
    if known.placing is None or not known.datums:
        return {}
    adjustment = variance_model(DEFAULT_MODEL)(features.pictures).adjustment
    left = adjustment.left(known.gradient_object) @ np.linalg.pinv(adjustment.placing.root)
    return {name: left[:, i] for i, name in enumerate(COMPONENTS)}


def by_geometry(features: Features, here: Station, given: Sequence[Source]) -> np.ndarray:
    """Derivatives of all M values by n inputs that move places in the image, of a picture of a station, (n, M)."""
    if not given:
        return np.zeros((0, len(features.known.quantities)))
    steps = STEP * np.array([each.scale for each in given])
    moved = [each.moved(here, sign * step) for sign in (1, -1) for each, step in zip(given, steps, strict=True)]
    ahead, behind = np.split(features.errors(moved), 2)
    return pulled(features.gradient_object, (ahead - behind) / (2 * steps[:, None]))


def pulled(gradient: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """gradient (M, q) . errors (n, q), where only what a quantity depends on has to be known, shape (n, M)."""
    return np.where(gradient == 0, 0.0, gradient * np.where(gradient == 0, 0.0, errors[:, None])).sum(-1)


def _by_brightness(here: Station, source: Source) -> np.ndarray:
    step = source.told.u or 1e-3 * source.scale
    if source.value != 0:
        step = min(step, abs(source.value) / 2)
    ahead, behind = (bias(source.moved(here, sign * step).pictures).values_object for sign in (1, -1))
    return (ahead - behind) / (2 * step)
