"""What a run has found of one quantity in one setting, and its status."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scenes import status as statuses
from validation import statistics
from validation.remeasured import Sample

STATUSES = tuple(sorted(statuses.ALL))


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
