"""What a state says: predicted sigmas, which edge limits, statuses, and why a pose is refused."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

import planner
from imaging.features.measurand import measurand
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.prediction import feature_covariances, glanced
from scenes import InvalidInput, Picture, Scene
from scenes.results import finite, picked
from scenes.status import GLANCED, MEANINGS, MEASURED, REMEDIES, is_trusted
from validation.explore.state import MOST_VIEWS, State


@dataclass(frozen=True, eq=False)
class Answer:
    """What is predicted at a state.

    Attributes
    ----------
    refused : str
        Why the poses cannot be taken; empty where they can, and all else is None or empty where not.
    prediction : Prediction or None
    shares : dict
        Part of the chosen measurand's variance that each edge or circle makes, by name, the largest first; the parts
        add up to 1. Empty where it cannot be measured.
    corners : ndarray, shape (2, 2)
        Where the sensor sees the measurand's two features, px.
    covariances : ndarray, shape (2, 2, 2)
        Their covariances, px^2; NaN of an edge.
    closely : bool
        Whether edges' surroundings and rims of circles were looked at.
    together : Combination or None
        What the pictures of the state's views and its own tell together; None without views, or at a glance.
    """

    refused: str = ""
    prediction: planner.Prediction | None = None
    shares: dict[str, float] | None = None
    corners: np.ndarray | None = None
    covariances: np.ndarray | None = None
    closely: bool = True
    together: planner.Combination | None = None

    @property
    def limiting(self) -> str | None:
        """The edge or circle that makes most of the variance."""
        return next(iter(self.shares), None) if self.shares else None


def answer(scene: Scene, state: State, *, closely: bool = True) -> Answer:
    """What is predicted there, by the calibrated model.

    Examples
    --------
    >>> import scenes
    >>> task1 = scenes.load("task1")
    >>> told = answer(task1, State.first(task1))
    >>> told.prediction.status, told.limiting
    ('ok', 'e9')
    """
    try:
        *others, picture = state.pictures(scene)
        predicted = planner.predict(picture, closely=closely)
        together = planner.combine([*map(_kept, others), predicted]) if others and closely else None
    except InvalidInput as error:
        return Answer(refused=str(error))
    pictures = Pictures.of(picture) if closely else glanced(picture)
    errors = variance_model("calibrated")(pictures)
    known = measurand(pictures, state.measurand)
    return Answer(
        prediction=predicted,
        shares=_shares(errors.parts(state.measurand)),
        corners=known.points,
        covariances=feature_covariances(pictures, errors, state.measurand),
        closely=closely,
        together=together,
    )


@lru_cache(maxsize=4 * MOST_VIEWS)
def _kept(picture: Picture) -> planner.Prediction:
    """Of a view that stays while another is moved."""
    return planner.predict(picture)


def _shares(parts: dict[str, np.ndarray]) -> dict[str, float]:
    total = sum(map(float, parts.values()))
    if not 0 < total < math.inf:
        return {}
    return {name: float(part) / total for name, part in sorted(parts.items(), key=lambda item: -item[1])}


def to_message(told: Answer) -> dict[str, Any]:
    """The answer as the page takes it; numbers that are not finite are null."""
    if told.prediction is None:
        return {"refused": told.refused}
    return {
        "refused": "",
        "closely": told.closely,
        "measurands": [_forecast(each, told.together, m) for m, each in enumerate(told.prediction.measurands)],
        "shares": told.shares,
        "limiting": told.limiting,
        "edges": [
            {"name": e.name, "status": e.status, "length": finite(e.length_px), "contrast": finite(e.contrast)}
            for e in told.prediction.edges
        ],
    }


def _forecast(each: planner.Forecast, together: planner.Combination | None, m: int) -> dict[str, Any]:
    more = {}
    if together is not None:
        sigma = finite(math.sqrt(together.variances[m]))
        more = {"together": {"sigma": sigma, "status": together.status[m], "views": int(together.used[:, m].sum())}}
    return more | {
        **picked(each, "name", "kind", "unit"),
        "value": finite(each.value_object),
        "nominal": finite(each.nominal),
        "sigma": finite(math.sqrt(each.variance_object)),
        "sigma_px": finite(math.sqrt(each.variance_image)),
        "ratio": None if each.ratio is None else finite(2 * each.ratio),
        "tolerance": None if each.tolerance is None else each.tolerance.half,
        "bias": finite(each.bias_object),
        "status": each.status,
        "doubt": _doubt(each.status),
        "why": MEANINGS[each.status],
        "reason": each.reason,
        "remedy": REMEDIES[each.status],
    }


def _doubt(status: str) -> str:
    """What the page of a station calls a requirement of which no value, or no sigma, can be relied on.

    >>> _doubt("short"), _doubt("clutter"), _doubt("ok"), _doubt("glanced")
    ('not measured', 'not proven', '', '')
    """
    if status not in MEASURED:
        return "not measured"
    return "" if is_trusted(status) or status == GLANCED else "not proven"
