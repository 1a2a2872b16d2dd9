"""What a run has found of one quantity in one setting, and its status."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenes import status as statuses
from validation import statistics
from validation.remeasured import Sample

STATUSES = tuple(sorted(statuses.ALL))
FOUND = [
    *((name, "f8") for name in ("empirical", "bias", "correction", "u_bias", "render_noise", "predicted_bias")),
    ("n", "i4"), ("failed", "i4"),
]  # fmt: skip
"""Columns of what one method found of one quantity: see `RepeatedValues.note`, `judged`."""


@dataclass(frozen=True, eq=False)
class RepeatedValues:
    """What one method measured in one setting.

    Attributes
    ----------
    propagated : float
        Predicted variance.
    distances : ndarray, shape (n,)
        Measured values, NaN where there is none.
    failures : dict
        Number of images by status, of those that are not ``ok``.
    clean : str
        Status of the noise-free image, once its bias is taken off.
    correction, u_bias : float
        Bias that a simulation tells and that is taken off, and its standard uncertainty (not variance); 0 and NaN where
        there was none.
    render_noise : float
        Standard deviation (not variance) of the mean error that is left by the renderer's own noise.
    """

    propagated: float
    distances: np.ndarray
    failures: dict[str, int]
    clean: str
    correction: float = 0.0
    u_bias: float = math.nan
    render_noise: float = 0.0

    def scatter(self, true: float) -> dict[str, float]:
        """Variance and mean error of the corrected values (NaN of too little), number of images, of failed ones."""
        sample = Sample.of(self.distances)
        left = sample.mean - self.correction - true
        return {"empirical": sample.variance, "bias": left, "n": sample.n, "failed": sample.failed}

    def note(self, record: np.void, true: float, predicted_bias: float) -> None:
        """Put it into a record that has the columns `FOUND`; of a bias that has been taken off none is expected."""
        told = {name: getattr(self, name) for name in ("correction", "u_bias", "render_noise")}
        told["predicted_bias"] = predicted_bias if math.isnan(self.u_bias) else 0.0
        for name, number in (told | self.scatter(true)).items():
            record[name] = number


def judged(record: np.void, predicted: float) -> dict[str, Any]:
    """What a record of `FOUND` says beside a predicted variance, as fields of `Judged`; None where nothing is known."""
    n, failed, empirical = int(record["n"]), int(record["failed"]), known(record["empirical"])
    ratio = empirical / predicted if empirical is not None and 0 < predicted < math.inf else None
    return {
        "n": n, "failed": failed, "ratio": ratio,
        "ratio_interval": None if ratio is None else statistics.ratio_interval(ratio, n - failed),
        "empirical": empirical, **{name: known(record[name]) for name in ("bias", "u_bias")},
        **{name: float(record[name]) for name in ("correction", "render_noise", "predicted_bias")},
    }  # fmt: skip


def known(number: np.floating | np.ndarray) -> float | None:
    """The number; None for NaN."""
    return None if np.isnan(number) else float(number)


def ratios(empirical: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Empirical over predicted variances; NaN where nothing was measured, or nothing was predicted."""
    usable = np.isfinite(empirical) & np.isfinite(predicted) & (predicted > 0)
    return np.divide(empirical, predicted, out=np.full(usable.shape, np.nan), where=usable)


def row_status(clean: str, others: dict[str, int], images: int) -> str:
    """Status of a setting: that of its noise-free image; if ``ok``, and too many of the noisy ones are not, theirs.

    Parameters
    ----------
    clean : str
        Status of the noise-free image.
    others : dict
        Number of noisy images by status, of those that are not ``ok``.
    images : int
        Noisy images in all; `statistics.STRAY` of them may be lost.

    Examples
    --------
    >>> row_status("ok", {"short": 1}, 100), row_status("ok", {"short": 1, "low_contrast": 2}, 100)
    ('ok', 'low_contrast')
    """
    if not statuses.is_trusted(clean) or sum(others.values()) <= statistics.STRAY * images:
        return clean
    return max(others, key=others.get)
