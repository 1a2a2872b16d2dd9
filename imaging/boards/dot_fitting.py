"""Blurred ellipses fitted to dots, many at once: levels linear in place, shape and blur free."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from imaging.boards.fitting import solved

_STEPS, _SETTLED = 20, 3e-4  # of Gauss and Newton; px of a centre's last step
_LARGEST = 0.5  # px, or times the size, of one step
_BLURS = 0.25, 8.0  # px, of an edge's profile
_TOGETHER = 2e6  # pixels of windows at a time
_BESIDE = 0.4  # of what is between a dot and the next: is looked at
_FARTHEST = 6.0  # px beside a dot that are looked at
_PARAMETERS = 10  # centre, shape, blur, level and its slopes, contrast


class Dots(NamedTuple):
    """Of n dots: centres (n, 2), px, their covariance for unit noise (n, 2, 2), squared residuals, degrees of freedom,
    contrast, grey levels, mean radius and blur, px, and whether the fit has come to rest, (n,) each."""

    centre: np.ndarray
    unit_covariance: np.ndarray
    square: np.ndarray
    freedom: np.ndarray
    contrast: np.ndarray
    radius: np.ndarray
    blur: np.ndarray
    converged: np.ndarray


def dot_reach(radius: np.ndarray, way: np.ndarray) -> np.ndarray:
    """How far about a dot's middle is looked at, px: by its larger radius, and the way to the next one."""
    return radius + np.minimum(_BESIDE * (way - 2 * radius), _FARTHEST)


def dot_expected(ellipse: np.ndarray, reach: float, blur: float) -> tuple[np.ndarray, np.ndarray]:
    """What is expected of a dot's centre as `fit_dots` finds it.

    Parameters
    ----------
    ellipse : ndarray, shape (5,)
        x, y, a, b, px, and angle, degrees.
    reach, blur : float
        How far it is looked at, and standard deviation of its edge's profile, px.

    Returns
    -------
    covariance : ndarray, shape (2, 2)
        At unit noise and contrast, px^2; infinite where too few pixels see it.
    leant : ndarray, shape (2, 2)
        Derivative of the centre by the light's slope over the light, px^2: a dot's levels are fitted as if its contrast
        were even.
    """
    half = int(np.ceil(reach)) + 2
    here = np.array([[*(ellipse[:2] - np.rint(ellipse[:2]) + half), *ellipse[2:]]])
    place, levels, there = _windows(np.zeros((2 * half + 1,) * 2), here, np.array([reach]))
    values = np.concatenate([here[:, :2], _shape(here), np.full((1, 1), np.clip(blur, *_BLURS))], 1)
    if there.sum() <= _PARAMETERS:
        return np.full((2, 2), np.inf), np.zeros((2, 2))
    expected = _linear(place, levels, there, values)[0][..., -1]
    matrix, residual, _ = _linear(place, expected, there, values)
    inverse = solved(matrix, residual)[1][0, :2]
    more = expected[0, :, None] * (place[0] - here[0, :2])
    return inverse[:, :2], inverse @ matrix[0].T @ more


def fit_dots(image: np.ndarray, start: np.ndarray, reach: np.ndarray) -> Dots:
    """Least squares for each dot in the pixels within reach of its middle.

    The edge's profile is that of a straight one, of a blur that is free: a small dot's is not quite, but as much so on
    all sides, so that its centre stays.

    Parameters
    ----------
    image : ndarray, shape (height, width)
    start : ndarray, shape (n, 5)
        x, y, a, b, px, and angle, degrees.
    reach : ndarray, shape (n,)
        px; windows lie within the image.
    """
    size = (2 * int(np.ceil(reach.max())) + 3) ** 2
    count = max(1, int(_TOGETHER / size))
    parts = [_fit(image, start[i : i + count], reach[i : i + count]) for i in range(0, len(start), count)]
    return Dots(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def dot_rows(image: np.ndarray, start: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives of x and y of dots, fitted as by `fit_dots`, by the pixels of their windows, (n, 2, P), places of
    these (n, P, 2), and which of them count (n, P)."""
    place, levels, there, values, _ = _fitted(image, start, reach)
    matrix, residual, _ = _linear(place, levels, there, values)
    return np.einsum("nij,npj->nip", solved(matrix, residual)[1][:, :2], matrix), place, there


def _fit(image: np.ndarray, start: np.ndarray, reach: np.ndarray) -> Dots:
    place, levels, there, values, rest = _fitted(image, start, reach)
    matrix, residual, best = _linear(place, levels, there, values)
    inverse = solved(matrix, residual)[1]
    determinant = values[:, 2] * values[:, 4] - values[:, 3] ** 2
    good = rest & (determinant > 0) & np.isfinite(residual).all(1) & (values[:, 5] < _BLURS[1])
    radius = np.where(determinant > 0, np.abs(determinant), 1.0) ** -0.25
    return Dots(
        values[:, :2], inverse[:, :2, :2], (residual**2).sum(1), there.sum(1) - _PARAMETERS, np.abs(best[:, 3]),
        radius, values[:, 5], good,
    )  # fmt: skip


def _fitted(image: np.ndarray, start: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, ...]:
    """Windows, the values (n, 6) that fit them best, and whether these have come to rest (n,)."""
    place, levels, there = _windows(image, start, reach)
    values = np.concatenate([start[:, :2], _shape(start), np.ones((len(start), 1))], 1)
    damping, before = np.ones((len(start), 1)), np.zeros((len(start), 2))
    live = np.arange(len(start))
    for _ in range(_STEPS):
        matrix, residual, _ = _linear(place[live], levels[live], there[live], values[live])
        step = solved(matrix, residual)[0][:, :6]
        back = (step[:, :2] * before[live]).sum(1, keepdims=True) < 0
        damping[live] = np.where(back, damping[live] / 2, np.minimum(1.5 * damping[live], 1.0))
        most = _LARGEST * _scale(np.abs(values[live, 2:5]).max(1, keepdims=True))
        step = np.clip(damping[live] * step, -most, most)
        before[live], values[live] = step[:, :2], values[live] + step
        values[live, 5] = np.clip(values[live, 5], *_BLURS)
        live = live[~(np.abs(step[:, :2]).max(1) < _SETTLED)]
        if not live.size:
            break
    return place, levels, there, values, ~np.isin(np.arange(len(start)), live)


def _scale(size: np.ndarray) -> np.ndarray:
    return np.concatenate([np.ones((len(size), 2)), np.repeat(size, 3, 1), np.ones((len(size), 1))], 1)


def _shape(start: np.ndarray) -> np.ndarray:
    """xx, xy, yy of M in u M u = 1, the ellipse about its centre, (n, 3)."""
    a, b, angle = start[:, 2], start[:, 3], np.radians(start[:, 4])
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([
        (cosine / a) ** 2 + (sine / b) ** 2, cosine * sine * (a**-2.0 - b**-2.0), (sine / a) ** 2 + (cosine / b) ** 2,
    ], 1)  # fmt: skip


def _windows(image: np.ndarray, start: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (n, P, 2), grey levels (n, P) and which of them count (n, P)."""
    half = int(np.ceil(reach.max())) + 1
    steps = np.arange(-half, half + 1)
    offset = np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2)
    place = np.rint(start[:, None, :2]).astype(int) + offset
    there = np.linalg.norm(place - start[:, None, :2], axis=-1) <= reach[:, None]
    inside = np.clip(place, 0, np.array(image.shape[::-1]) - 1)
    return place.astype(float), np.where(there, image[inside[..., 1], inside[..., 0]], 0.0), there


def _linear(place, levels, there, values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Jacobian (n, P, 10), residual (n, P), and the levels that fit best (n, 4)."""
    u = place - values[:, None, :2]
    (xx, xy, yy), blur = values[:, 2:5].T[..., None], values[:, 5:6]
    pulled = np.stack([xx * u[..., 0] + xy * u[..., 1], xy * u[..., 0] + yy * u[..., 1]], -1)
    q = np.sqrt(np.maximum((u * pulled).sum(-1), 1e-6))
    steep = np.maximum(np.linalg.norm(pulled, axis=-1) / q, 1e-9)  # gradient of q, 1 / px
    away = (q - 1) / steep / blur
    covered, density = ndtr(-away), np.exp(-(away**2) / 2) / np.sqrt(2 * np.pi)
    basis = np.concatenate([np.ones((*q.shape, 1)), u / 10.0, covered[..., None]], -1) * there[..., None]
    best = solved(basis, levels)[0]
    residual = np.where(there, levels - np.einsum("npk,nk->np", basis, best), 0.0)
    inward = best[:, 3:4] * density / blur * there  # of the level by the distance
    by_shape = -np.stack([u[..., 0] ** 2, 2 * u[..., 0] * u[..., 1], u[..., 1] ** 2], -1) / (2 * q * steep)[..., None]
    slopes = np.concatenate([pulled / (q * steep)[..., None], by_shape, away[..., None]], -1) * inward[..., None]
    return np.concatenate([slopes, basis], -1), residual, best
