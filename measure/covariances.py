"""Covariances of values from those of what they are found from. NumPy alone: a recipe has this file."""

from __future__ import annotations

import numpy as np


def spread(rows: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Covariance (n, k, k) of what moves by rows (n, k, q) with errors of covariance (n, q, q); NaN where it depends on
    what is not found."""
    lost = ~np.isfinite(np.einsum("nqq->nq", errors))
    if not lost.any():
        return _symmetric(rows @ errors @ np.swapaxes(rows, -1, -2))
    whole = np.where(lost[:, :, None] | lost[:, None, :], 0.0, errors)
    used = np.where((rows == 0) | lost[:, None], 0.0, rows)
    found = _symmetric(used @ whole @ np.swapaxes(used, -1, -2))
    missing = ((rows != 0) & lost[:, None]).any(-1)
    return np.where(missing[:, :, None] | missing[:, None, :], np.nan, found)


def _symmetric(product: np.ndarray) -> np.ndarray:
    """Without what rounding makes of a product."""
    return (product + np.swapaxes(product, -1, -2)) / 2


def of_measured(covariance: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Covariances (..., M, M), infinite on the diagonal of what is not ``measured``, bool (..., M), NaN beside it."""
    if measured.all():
        return covariance.copy()
    both = measured[..., :, None] & measured[..., None, :]
    lost = np.where(np.eye(measured.shape[-1], dtype=bool), np.inf, np.nan)
    return np.where(both, covariance, lost)


def scaled(covariance: np.ndarray, propagated: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Covariances (..., M, M) with the marked variances replaced by propagated ones, correlations as they are."""
    if not which.any():
        return covariance
    own, told = np.einsum("...mm->...m", covariance), np.diag(propagated)
    usable = which & np.isfinite(own) & (own > 0) & np.isfinite(told)
    factor = np.sqrt(np.divide(told, own, out=np.ones(own.shape), where=usable))
    return covariance * factor[..., :, None] * factor[..., None, :]


def less_bias(
    value: np.ndarray, covariance: np.ndarray, off: np.ndarray, propagated: np.ndarray, doubtful: np.ndarray,
    measured: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Values (..., M) with their biases ``off`` taken off, and their covariances: variances of what is ``doubtful`` by
    itself are the propagated ones; what is not ``measured``, bool (..., M) both, is no number."""
    return np.where(measured, value - off, np.nan), of_measured(scaled(covariance, propagated, doubtful), measured)
