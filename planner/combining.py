"""Several independent pictures of one object: what their values are worth together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imaging.models.bias import MOST
from planner.forecast import mildest
from planner.prediction import Prediction
from scenes.status import is_trusted

_FURTHER = 1e-6  # of each variance: a further, independent error without which a joint covariance may be singular


@dataclass(frozen=True, eq=False)
class Combination:
    """M quantities from V pictures whose noise is independent, in the scene's unit or degrees.

    Attributes
    ----------
    used : ndarray of bool, shape (V, M)
        Which pictures a quantity is taken from: those in which it is ``ok``; where it is so in none, those in which it
        is ``clutter``.
    weights : ndarray, shape (V, M)
        Of each picture's value, by inverse variance; they add to 1, or are all 0 where a quantity cannot be measured.
    covariance : ndarray, shape (M, M)
        Joint covariance of the values weighted so; infinite on the diagonal, NaN beside it, where there is none.
    gains : ndarray, shape (V, M, M)
        What the values of each picture are multiplied with for the generalised least-squares combination, which also
        uses how the values of one picture are correlated: the sum of gains[v] @ values[v].
    covariance_least_squares : ndarray, shape (M, M)
        Its joint covariance: no variance is above that by inverse variance (but for a millionth).
    bias : ndarray, shape (M,)
        Of the values weighted so; NaN where it is not known.
    status : tuple of str
        ``ok``, ``clutter`` where no picture is ok or the bias is above 0.3 of the combined sigma, else why there is no
        value.
    """

    used: np.ndarray
    weights: np.ndarray
    covariance: np.ndarray
    gains: np.ndarray
    covariance_least_squares: np.ndarray
    bias: np.ndarray
    status: tuple[str, ...]

    @property
    def variances(self) -> np.ndarray:
        """Of each quantity by inverse variance, shape (M,); infinite where it cannot be measured."""
        return np.diag(self.covariance).copy()

    def weighted(self, values: np.ndarray) -> np.ndarray:
        """Values (V, ..., M) of the pictures combined by inverse variance, shape (..., M); NaN where there is none."""
        parts = np.where(self._over(self.used, values), values, 0.0) * self._over(self.weights, values)
        return np.where(self.used.any(0), parts.sum(0), np.nan)

    def least_squares(self, values: np.ndarray) -> np.ndarray:
        """The same by generalised least squares."""
        known = np.where(self._over(self.used, values), values, 0.0)
        return np.where(self.used.any(0), np.einsum("vmn,v...n->...m", self.gains, known), np.nan)

    @staticmethod
    def _over(each: np.ndarray, values: np.ndarray) -> np.ndarray:
        """An array (V, M) shaped so that it broadcasts against values (V, ..., M)."""
        return each.reshape(len(each), *(1,) * (values.ndim - 2), each.shape[-1])


def combine(predictions: Sequence[Prediction]) -> Combination:
    """What pictures with these predictions tell together.

    By inverse variance each quantity for itself; by generalised least squares (Aitken 1936) all jointly: the covariance
    is the inverse of the sum of the pictures' information, each about the quantities that it is used for.

    Examples
    --------
    >>> import planner, scenes
    >>> one = planner.predict(scenes.load("task1"), (30, 135), (15, 315))
    >>> both = combine([one, one])
    >>> both.weights.ravel().tolist(), round(float(both.variances[0] / one.variance_object), 12)
    ([0.5, 0.5], 0.5)
    """
    status = np.array([[each.status for each in told.measurands] for told in predictions])
    biases = np.array([[each.bias_object for each in told.measurands] for told in predictions])
    return combined(np.stack([told.covariance_object for told in predictions]), status, biases)


def combined(covariances: np.ndarray, status: np.ndarray, biases: np.ndarray) -> Combination:
    """The same from joint covariances (V, M, M), statuses (V, M) and biases (V, M)."""
    single = np.einsum("vmm->vm", covariances)
    used = _used(np.isfinite(single), status)
    information = np.where(used, 1 / np.where(used, single, 1.0), 0.0)
    whole = information.sum(0)
    weights = information / np.where(whole > 0, whole, 1.0)
    together = np.where(used[:, :, None] & used[:, None, :], covariances, 0.0)
    covariance = np.einsum("vm,vn,vmn->mn", weights, weights, together)
    gains, jointly = _least_squares(together, used)
    lost = ~used.any(0)
    with np.errstate(invalid="ignore"):
        bias = np.where(lost, np.nan, np.where(used, weights * biases, 0.0).sum(0))
        off = np.abs(bias) > MOST * np.sqrt(np.diag(covariance))
    told = [mildest(map(str, each[own] if own.any() else each)) for each, own in zip(status.T, used.T, strict=True)]
    told = ["clutter" if is_trusted(state) and moved else state for state, moved in zip(told, off, strict=True)]
    return Combination(used, weights, _marked(covariance, lost), gains, _marked(jointly, lost), bias, tuple(told))


def _used(measured: np.ndarray, status: np.ndarray) -> np.ndarray:
    """Of each quantity the pictures in which it is ok, or all that measure it if there are none; bool (V, M)."""
    fine = measured & is_trusted(status)
    return np.where(fine.any(0), fine, measured)


def _least_squares(covariances: np.ndarray, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gains (V, M, M) and joint covariance (M, M); 0 for what is not used."""
    pictures, count = used.shape
    size = np.sqrt(np.einsum("vmm->vm", covariances)).max(0)
    size = np.where(size > 0, size, 1.0)
    information = np.zeros((pictures, count, count))
    for v in range(pictures):
        seen = np.flatnonzero(used[v])
        own = covariances[v][np.ix_(seen, seen)] / np.outer(size[seen], size[seen])
        own = own + _FURTHER * np.diag(np.diag(own))
        information[v][np.ix_(seen, seen)] = np.linalg.inv(own)
    known = np.flatnonzero(used.any(0))
    joint = np.zeros((count, count))
    joint[np.ix_(known, known)] = np.linalg.inv(information.sum(0)[np.ix_(known, known)])
    gains = (joint @ information) * size[:, None] / size
    return gains, np.einsum("vmi,vij,vnj->mn", gains, covariances, gains)


def _marked(covariance: np.ndarray, lost: np.ndarray) -> np.ndarray:
    """Infinite on the diagonal and NaN beside it where there is no value."""
    either = lost[:, None] | lost[None, :]
    return np.where(either, np.where(np.eye(len(lost), dtype=bool), np.inf, np.nan), covariance)
