"""One setting in many pictures: the scatter of what each estimator measures, beside what is said of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from threadpoolctl import threadpool_limits

import measure
import planner
import render
from scenes import InvalidInput, status
from tests.proofs.agreement.settings import Place
from validation.batch.repeated import row_status
from validation.plan_check import without_formula
from validation.statistics import ratio_interval

KINDS = "calibrated", "propagated", "reported"
ESTIMATORS = "gradient", "canny", "isophote", "strip", "arrangement"
_BATCH = 50  # pictures held in memory at a time


@dataclass(frozen=True)
class Row:
    """One setting and one estimator.

    Attributes
    ----------
    group, index : str and int
        Which setting.
    sensor, light : pair of float
        Degrees.
    estimator : str
    status : str
        ``ok`` where the noise-free picture and at least 99 % of the noisy ones are; else that of the noise-free one,
        or what most of the others say. ``refused`` where the setting cannot be worked on, for the `reason`.
    n, failed : int
        Noisy pictures measured, and not.
    empirical : float
        Sample variance of the measured distances, px^2.
    calibrated, propagated, reported : float
        Variance (not sigma) from the planner's closed form for ``gradient``, from the noise-free picture for this
        estimator, and from the pictures themselves (mean), px^2.
    bias_px : float
        Mean distance less the projected one, px.
    without_formula : tuple of str
        Effects simulated there that the planner has no formula for.
    """

    group: str
    index: int
    sensor: tuple[float, float]
    light: tuple[float, float]
    estimator: str
    status: str
    n: int
    failed: int
    empirical: float
    calibrated: float
    propagated: float
    reported: float
    bias_px: float
    without_formula: tuple[str, ...] = ()
    reason: str = ""

    @property
    def judged(self) -> bool:
        """Only what says ``ok`` of itself has promised anything."""
        return self.status == status.OK

    def ratio(self, kind: str) -> float:
        """Empirical over one of the three variances; NaN where either is unknown."""
        known = getattr(self, kind)
        return self.empirical / known if np.isfinite(known) and known > 0 else float("nan")

    def interval(self, kind: str) -> tuple[float, float]:
        """95 % chi-square interval of `ratio`."""
        return ratio_interval(self.ratio(kind), self.n)

    @property
    def bias_over_sigma(self) -> float:
        """Bias in units of the predicted standard deviation."""
        return self.bias_px / np.sqrt(self.propagated) if np.isfinite(self.propagated) else float("nan")


class _Values(NamedTuple):
    """What one estimator says of all noisy pictures."""

    distance: np.ndarray
    variance: np.ndarray
    state: np.ndarray


def rows_of(place: Place, renders: int, seed: int, variant: str) -> list[Row]:
    """Render a setting, expose it ``renders`` times, measure by every estimator; one thread, at most 50 pictures held.

    As `ice validate` measures: the light is known.
    """
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(1):
            return _rows(place, renders, seed, variant)
    except InvalidInput as error:
        return [_refused(place, estimator, str(error)) for estimator in ESTIMATORS]


def _rows(place: Place, renders: int, seed: int, variant: str) -> list[Row]:
    scene, sensor, light = place.scene, place.sensor, place.light
    predicted = planner.predict(scene, sensor, light)
    clean = render.image(scene, sensor, light, variant=variant)
    unknown, found = without_formula(scene, sensor, light), _measured(place, clean, renders, seed)
    rows = []
    for estimator in ESTIMATORS:
        propagated = measure.propagate(clean, scene, sensor, light, estimator)
        values = found[estimator]
        good = np.isfinite(values.distance)
        several, any_ = good.sum() > 1, good.any()
        rows.append(
            Row(
                group=place.group,
                index=place.index,
                sensor=tuple(sensor),
                light=tuple(light),
                estimator=estimator,
                status=row_status(propagated.status, _others(values.state), values.state.size),
                n=int(good.sum()),
                failed=int((~good).sum()),
                empirical=float(values.distance[good].var(ddof=1)) if several else float("nan"),
                calibrated=predicted.variance_px2,
                propagated=propagated.variance_px2,
                reported=float(values.variance[good].mean()) if any_ else float("nan"),
                bias_px=float(values.distance[good].mean()) - predicted.value_px if any_ else float("nan"),
                without_formula=unknown,
            )
        )
    return rows


def _measured(place: Place, clean: np.ndarray, renders: int, seed: int) -> dict[str, _Values]:
    """All estimators on the same noisy pictures, all pixels of which are exposed."""
    parts: dict[str, list[measure.Measurement]] = {estimator: [] for estimator in ESTIMATORS}
    for batch, first in enumerate(range(0, renders, _BATCH)):
        count = min(_BATCH, renders - first)
        pictures = render.expose(clean, place.scene.noise, place.rng(seed, batch), count)
        for estimator, found in parts.items():
            found.append(measure.distance(pictures, place.scene, place.sensor, place.light, estimator))
    columns = "value_px", "variance_px2", "status"
    return {
        estimator: _Values(*(np.concatenate([getattr(part, column) for part in found]) for column in columns))
        for estimator, found in parts.items()
    }


def _others(state: np.ndarray) -> dict[str, int]:
    """Number of pictures by status, of those that are not ``ok``."""
    return dict(Counter(state[state != status.OK].tolist()))


def _refused(place: Place, estimator: str, reason: str) -> Row:
    nothing = (float("nan"),) * 5
    poses = tuple(place.sensor), tuple(place.light)
    return Row(place.group, place.index, *poses, estimator, "refused", 0, 0, *nothing, reason=reason)
