"""The sensor's noise by its own photographs: EMVA 1288's photon transfer, or what a single photograph tells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from measure.fitting.photograph import Pixels, Shots
from scenes import Noise

_ROUNDS = 20
_FLAT = 1.0  # standard deviations of noise by which neighbours of one surface may differ


class Curve(NamedTuple):
    """Variance of the noise, dark + gain x signal.

    Attributes
    ----------
    dark, gain : float
        Squared grey levels, rounding included; grey levels an electron.
    covariance : ndarray, shape (2, 2)
    freedom : float
        Independent squares that tell it.
    """

    dark: float
    gain: float
    covariance: np.ndarray
    freedom: float

    def noise(self, noise: Noise) -> Noise:
        """The sensor with this noise: rounding (1/12) is taken out of the temporal dark noise."""
        rounding = 0.0 if noise.bits is None else 1 / 12
        sigma = float(np.sqrt(max(self.dark - rounding, 1e-12)))
        return noise.model_copy(update={"sigma": sigma, "gain": self.gain, "excess": ()})


def by_repetition(shots: Shots, pixels: Pixels, signal: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Signals (n,), variances (n,) and degrees of freedom of each, of repeated photographs."""
    return signal, pixels.of(shots.scatter), shots.count - 1.0


def by_neighbours(
    shots: Shots, pixels: Pixels, signal: np.ndarray, expected: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """The same of one photograph: half the squared difference of what the model leaves of two neighbours.

    Differences do not see what is smooth in the residual, so that a picture that is not the model's does not pass as a
    noisy one. Only neighbours count that the model has on one surface, less than the noise (variance ``expected``)
    apart, no pixel twice.
    """
    residual = (pixels.of(shots.mean) - signal).reshape(pixels.shape)
    level = signal.reshape(pixels.shape)
    width = pixels.shape[2] // 2 * 2
    left, right = (np.s_[:, :, i:width:2] for i in (0, 1))
    flat = np.abs(level[left] - level[right]) < _FLAT * np.sqrt(expected)
    halves = (residual[left] - residual[right]) ** 2 / 2
    return ((level[left] + level[right]) / 2)[flat], halves[flat], 1.0


def curve(signal: np.ndarray, variance: np.ndarray, freedom: np.ndarray) -> Curve:
    """The most likely noise curve of sample variances.

    Parameters
    ----------
    signal, variance, freedom : ndarray, shape (n,)
        Signals above darkness, sample variances (squared grey levels) there, and degrees of freedom of each.

    Returns
    -------
    Curve
        A sample variance of f degrees of freedom is v chi-square / f, of variance 2 v^2 / f: Fisher scoring. A gain
        below 0 is none.
    """
    dark, gain = max(float(np.average(variance, weights=freedom)), 1e-9), 0.0
    design = np.stack([np.ones_like(signal), np.maximum(signal, 0.0)], 1)
    told = np.ptp(signal) > 0
    for _ in range(_ROUNDS):
        model = np.maximum(design @ [dark, gain], 1e-9)
        weight = freedom / (2 * model**2)
        fisher = design.T @ (design * weight[:, None])
        if told:
            found = np.linalg.solve(fisher, design.T @ (weight * variance))
        if not told or found[1] < 0 or found[0] <= 0:
            alone = 0 if not told or found[1] < 0 else 1
            found = np.zeros(2)
            found[alone] = design[:, alone] @ (weight * variance) / fisher[alone, alone]
        moved = np.abs(found - (dark, gain)).max()
        dark, gain = found.tolist()
        if moved < 1e-9 * (dark + gain):
            break
    covariance = np.linalg.inv(fisher) if told else np.diag([1 / fisher[0, 0], 0.0])
    return Curve(dark, gain, covariance, float(np.sum(freedom)))
