"""Crossings fitted to their windows by least squares: under white noise the likeliest ones, at the Cramer-Rao bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.boards.saddle import SHAPE, response
from imaging.boards.windows import Windows

_LEVELS = 12  # linear in place in each of four quadrants
PARAMETERS = SHAPE + _LEVELS
_STEPS = 15
_LARGEST = np.array([0.7, 0.7, 0.15, 0.15, 0.3])  # of a step
_BLURS = np.log([0.35, 6.0])  # px; below, three points a pixel are too few, and a pixel hardly tells
_TOGETHER = 64  # corners at a time: some 100 MB


@dataclass(frozen=True, eq=False)
class Crossings:
    """Fitted crossings.

    Attributes
    ----------
    shape : ndarray, shape (n, 5)
        As of `imaging.boards.saddle.response`.
    unit_covariance : ndarray, shape (n, 2, 2)
        Of x and y for noise of variance 1 in each pixel, px^2.
    square : ndarray, shape (n,)
        Sum of squared residuals.
    freedom : ndarray, shape (n,)
        Its degrees of freedom.
    contrast : ndarray, shape (n,)
        Half the difference of bright and dark, grey levels.
    converged : ndarray of bool, shape (n,)
    """

    shape: np.ndarray
    unit_covariance: np.ndarray
    square: np.ndarray
    freedom: np.ndarray
    contrast: np.ndarray
    converged: np.ndarray


def fit_crossings(found: Windows, start: np.ndarray, bend: np.ndarray, enough: float) -> Crossings:
    """Fit n crossings, each to its own window.

    Parameters
    ----------
    found : Windows
        Of n corners, all with room.
    start : ndarray, shape (n, 5)
    bend : ndarray, shape (n, 2)
        Known curvatures of the edges, 1/px.
    enough : float
        Step at which it is done, px.
    """
    some = [np.s_[i : i + _TOGETHER] for i in range(0, len(start), _TOGETHER)]
    parts = [_fit(found.places[s], found.levels[s], found.there[s], start[s], bend[s], enough) for s in some]
    return Crossings(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def crossing_rows(found: Windows, shape: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Derivatives of x and y of n fitted crossings by their windows' pixels, (n, 2, pixels)."""
    rows = []
    for first in range(0, len(shape), _TOGETHER):
        s = np.s_[first : first + _TOGETHER]
        places, levels, there = found.places[s], found.levels[s], found.there[s]
        field = np.where(there[..., None], _field(places, shape[s]), 0.0)
        matrix, residual, *_ = _linear(places, levels, there, shape[s], bend[s], field)
        matrix[np.isin(shape[s][:, 4], _BLURS), :, 4] = 0.0
        rows.append(np.einsum("nij,npj->nip", solved(matrix, residual)[1][:, :2], matrix))
    return np.concatenate(rows)


def _fit(places, levels, there, shape, bend, enough) -> tuple[np.ndarray, ...]:
    first, shape = shape, shape.copy()
    size = there.sum(1)
    field = np.where(there[..., None], _field(places, first), 0.0)
    damping, before = np.ones((len(shape), 1)), np.zeros((len(shape), 2))
    for _ in range(_STEPS):
        matrix, residual, square, contrast = _linear(places, levels, there, shape, bend, field)
        matrix[np.isin(shape[:, 4], _BLURS), :, 4] = 0.0  # a blur at its end stays there
        step, inverse = solved(matrix, residual)
        back = (step[:, :2] * before).sum(1, keepdims=True) < 0
        damping = np.where(back, damping / 2, np.minimum(1.5 * damping, 1.0))  # to and fro: where no model fits well
        step = damping * np.clip(step[:, :SHAPE], -_LARGEST, _LARGEST)
        before, shape = step[:, :2], shape + step
        shape[:, 4] = np.clip(shape[:, 4], *_BLURS)
        moved = np.abs(before).max(1)
        if (moved < enough).all():  # the last step is taken; what was before it differs by its square
            break
    good = (moved < 10 * enough) & np.isfinite(square)
    return shape, inverse[:, :2, :2], square, size - PARAMETERS, contrast, good


def _field(places: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """1 and place, about -1 to 1."""
    away = (places - shape[:, None, :2]) / 10.0
    return np.concatenate([np.ones((*away.shape[:2], 1)), away], -1)


def _linear(places, levels, there, shape, bend, field):
    """Jacobian and residual at the levels that fit best: the levels are linear, and solved for exactly."""
    told = response(places, shape, bend)
    signs = np.concatenate([np.ones((*there.shape, 1)), told.signs], -1)
    basis = (signs[..., None] * field[..., None, :]).reshape(*there.shape, _LEVELS)
    best, _ = solved(basis, levels)
    fields = np.einsum("npj,nkj->npk", field, best.reshape(-1, 4, 3))
    slopes = np.einsum("npk,npks->nps", fields[..., 1:], told.slopes)
    residual = np.where(there, levels - np.einsum("npj,nj->np", basis, best), 0.0)
    return np.concatenate([slopes, basis], -1), residual, (residual**2).sum(1), np.abs(best[:, 9])


def solved(matrix: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least squares for each of n, columns scaled; and the inverse normal matrix."""
    size = np.sqrt((matrix**2).sum(1))
    size = np.where(size > 0, size, 1.0)
    unit = matrix / size[:, None]
    inverse = np.linalg.pinv(unit.transpose(0, 2, 1) @ unit, rcond=1e-12, hermitian=True)
    inverse = inverse / size[:, :, None] / size[:, None]
    return np.einsum("nij,npj,np->ni", inverse, matrix, right, optimize=True), inverse
