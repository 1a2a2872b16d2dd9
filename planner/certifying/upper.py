"""Upper bounds of variances in pairs of cells, and whether all their poses can be measured."""

from __future__ import annotations

import numpy as np

from imaging.features.locator import MIN_CONTRAST
from planner.certifying.cells import LightCells, SensorCells, Table, leaning, paired
from planner.certifying.enclosed import HUGE, ROUNDING
from planner.certifying.series import DEGREE

_TERMS = DEGREE + 1  # of the light's polynomial: what follows is how far off it may be


def upper_bounds(sensors: SensorCells, lights: LightCells, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Upper bounds of the calibrated variances of M quantities in pairs of cells (p, 2).

    Infinite where a pose may be one that cannot measure: an edge of which too little may be left, whose contrast may be
    too little, or that may be cut off at the end of the scale, and corners that may be too flat.

    Returns
    -------
    bound : ndarray, shape (p, M)
        Times the shares of the sensors' aim.
    parts : ndarray, shape (p, 2)
        What of its distance from the value in the middle the sensors' cell and the lights' make.
    """
    s, k = paired(sensors, lights, pairs)
    with np.errstate(all="ignore"):
        added = (s.spare * k.high[..., _TERMS:]).sum((-1, -2))
        at_middle, by_sensor, by_light = leaning(s, k, _TERMS)
        bound = np.fmin(_by_ranges(s, k), at_middle + by_sensor + by_light) + added
    known = s.sure & ~lights.hot[pairs[:, 1]] & _stands_out(k)
    bound = np.where(known[:, None] & (bound < HUGE), bound * (1 + ROUNDING), np.inf)
    parts = [np.nan_to_num(part, nan=HUGE, posinf=HUGE).sum(-1) for part in (by_sensor, by_light)]
    return bound, np.stack(parts, -1)


def _by_ranges(s: Table, k: Table) -> np.ndarray:
    """Upper bound (p, M) from the ranges of all factors alone."""
    ends = [one[..., :_TERMS] * two[..., :_TERMS] for one in (s.low, s.high) for two in (k.low, k.high)]
    return np.maximum.reduce(ends).sum((-1, -2))


def _stands_out(k: Table) -> np.ndarray:
    """Whether the contrast of all edges is enough all along them, bool (p,).

    A polynomial is nowhere above the largest of its coefficients in Bernstein's basis; of noise over squared contrast
    it is never more, by no more than the last term.
    """
    most = k.high[..., :_TERMS].max(-1) + k.high[..., -1]
    return (most * (1 + ROUNDING) < MIN_CONTRAST**-2).all((-1, -2))
