"""Is a measurement good enough for a tolerance? Ratios of uncertainty to tolerance, and indices from repeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.uncertainty.checks import check_finite, check_positive
from scenes.errors import InvalidInput


@dataclass(frozen=True)
class Gauge:
    """Capability indices of repeats on one part (gauge study of type 1).

    Attributes
    ----------
    cg : float
        0.2 T / (6 s): the share of the tolerance that the scatter is given. 1.33 is the usual least.
    cgk : float
        (0.1 T - bias) / (3 s), the absolute bias taken off; negative where it alone is too large.
    mean, s, bias : float
        Of the repeats; s is the standard deviation with n - 1, bias the mean less the reference.
    n : int
    reference, width : float
        Calibrated value of the part, and T, the whole width of the tolerance.
    """

    cg: float
    cgk: float
    mean: float
    s: float
    bias: float
    n: int
    reference: float
    width: float


def tur(width: float, U: float) -> float:
    """Test uncertainty ratio T / (2 U): the tolerance's whole width over that of the 95 % interval (ANSI/NCSL Z540.3).

    >>> tur(0.04, 0.005)
    4.0
    """
    check_positive("width", width)
    check_positive("U", U)
    return width / (2 * U)


def gauge(repeats: Sequence[float] | np.ndarray, reference: float, width: float) -> Gauge:
    """Cg and Cgk of repeated measurements, by the convention of 20 % of the tolerance and six standard deviations.

    Parameters
    ----------
    repeats : array-like, shape (n,)
        Finite, at least 2, not all the same.
    reference : float
        Calibrated value of the measured part.
    width : float
        T, the tolerance's whole width, in the repeats' unit.

    Raises
    ------
    InvalidInput

    Examples
    --------
    >>> found = gauge([10.002, 10.000, 10.003, 10.001, 9.999], reference=10.0, width=0.1)
    >>> round(found.cg, 3), round(found.cgk, 3)
    (2.108, 1.897)
    """
    values = np.asarray(repeats, float)
    check_positive("width", width)
    if values.ndim != 1 or len(values) < 2 or not np.isfinite(values).all():
        raise InvalidInput(f"repeats must be at least 2 finite numbers in a row, got an array of shape {values.shape}")
    check_finite("reference", reference)
    if np.ptp(values) == 0:
        raise InvalidInput(f"repeats must be different from each other, got {values[0]} every time")
    mean, s = float(values.mean()), float(values.std(ddof=1))
    bias = mean - reference
    cg, cgk = 0.2 * width / (6 * s), (0.1 * width - abs(bias)) / (3 * s)
    return Gauge(cg, cgk, mean, s, bias, len(values), reference, width)
