"""What photographs tell of each parameter: Fisher information, and where it is less than it seems."""

from __future__ import annotations

import numpy as np

from measure.fitting.likelihood import Problem
from measure.fitting.parameters import Parameters
from scenes import Noise

_HARMLESS = 0.3  # standard errors that a value may move with what is held
_SINGULAR = 1e-10  # of the information's largest eigenvalue, parameters scaled alike


def covariance_of(white: np.ndarray) -> np.ndarray:
    """Inverse Fisher information (f, f) of a whitened Jacobian (P, f); infinite variances where it is singular."""
    fisher = white.T @ white
    told = np.diag(fisher)
    if not (told > 0).all():
        return np.diag(np.where(told > 0, 1.0, np.inf))
    scale = 1 / np.sqrt(told)
    values, vectors = np.linalg.eigh(fisher * scale[:, None] * scale)
    values = np.maximum(values, _SINGULAR * values[-1])
    return (vectors / values) @ vectors.T * scale[:, None] * scale


def are_told(parameters: Parameters, which: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Which of the parameters are told by the photographs, bool (f,).

    The one of the largest standard error is held, where that is beyond what a linear model bears, until there is none.
    """
    known, kept = np.array([parameters.free[i].known for i in which]), np.ones(which.size, bool)
    while kept.any():
        ratio = np.where(kept, 0.0, -1.0)
        ratio[kept] = np.sqrt(np.diag(covariance_of(white[:, kept]))) / known[kept]
        if ratio.max() <= 1:
            break
        kept[np.argmax(ratio)] = False
    return kept


def are_alone(
    problem: Problem, at: np.ndarray, noise: Noise, which: np.ndarray, white: np.ndarray, variance: np.ndarray
) -> np.ndarray:
    """Which of the free parameters hardly move with what is held, which may be anything within reason, bool (f,)."""
    covariance, held = covariance_of(white), np.setdiff1d(np.arange(at.size), which)
    beside = problem.jacobian(at, noise, held) / np.sqrt(variance)[:, None]
    moved = covariance @ (white.T @ beside) * [problem.parameters.free[i].known for i in held]
    return (np.abs(moved) < _HARMLESS * np.sqrt(np.diag(covariance))[:, None]).all(1)
