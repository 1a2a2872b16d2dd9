"""Are the errors of an arrangement's corners linear in the noise, as their covariance says?

Drawn images answer it: their most likely corners beside those that the linear response gives. Where the expansion holds
they are cheap; where it does not, a few are measured in full.
"""

from __future__ import annotations

import numpy as np

from imaging.models.reach import asked_of
from measure.estimators.arrangement import ArrangementEstimator, Centre

_CHEAP, _FULL = 256, (24, 96)  # drawn images; of those measured in full more where the first leave it open
_BEYOND = 0.05  # part of them that may leave the expansion's range
_OFF = 0.1  # standard deviations by which they have left it
_BIAS = 0.2  # standard deviations: a larger mean error is no linear effect of the noise
_APART = 0.3  # standard deviations between full and linear errors, root mean square
_ALIKE = 1.1  # ratio of variances, full and to first order, up to which they are alike
_KNOWN = 1.25  # ratio of variances, where the other vertices are known and where not, up to which an image tells enough


def is_reliable(tool: ArrangementEstimator, centre: Centre) -> bool:
    """Whether an image tells what is measured, and the errors are linear in its noise.

    What is measured is the distance of two corners, or all coordinates of any other number of them. Knowledge of where
    the other vertices are must not decide: without it the variance may be a quarter larger.
    """
    index = tool.index(tool.arrangement.corners)
    rows = asked_of(centre.state.vertices[tool.arrangement.corners])
    here, wherever = (
        np.einsum("ki,ij,kj->k", rows, whole[np.ix_(index, index)], rows)
        for whole in (centre.covariance, tool.wherever(centre))
    )
    if not np.isfinite(here).all() or (wherever > _KNOWN * here).any():
        return False
    if _is_linear_nearby(centre, index, rows):
        return True
    for count in _FULL:
        linear, full = (errors[:, index] @ rows.T for errors in tool.drawn(centre, count))
        if _is_linear(linear, full, 0.0):
            return True
        if not _is_linear(linear, full, 2 / np.sqrt(count)):
            return False
    return False


def _is_linear(linear: np.ndarray, full: np.ndarray, leeway: float) -> bool:
    """Whether full errors (n, k) are those to first order, within so many root mean squares of what they differ by."""
    spread, apart = linear.std(0), full - linear
    differ = np.sqrt((apart**2).mean(0)) / spread
    unbiased = np.abs(apart.mean(0)) / spread <= _BIAS + leeway * differ
    near = differ <= _APART * (1 + leeway)
    alike = np.abs(np.log(full.var(0) / linear.var(0))) <= np.log(_ALIKE) + 2 * leeway * differ
    return bool((unbiased & near & alike).all())


def _is_linear_nearby(centre: Centre, index: np.ndarray, rows: np.ndarray) -> bool:
    """Whether the expansion says so. Where it does not, it may have been left: full errors will tell."""
    drawn = centre.expansion.drawn(_CHEAP)
    linear, full = drawn.linear[:, index] @ rows.T, drawn.steps[:, index] @ rows.T
    beyond = drawn.left[:, index] @ np.abs(rows).T > _OFF * linear.std(0)
    return bool(beyond.any(1).mean() <= _BEYOND and _is_linear(linear, full, 0.0))
