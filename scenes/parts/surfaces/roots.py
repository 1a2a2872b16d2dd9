"""Real roots of polynomials of low degree, stable where they are double or the leading coefficient is small."""

from __future__ import annotations

import numpy as np

_HALVINGS, _NEWTON = 60, 3
_EXACT = 4 * np.finfo(float).eps


def quadratic_roots(a: np.ndarray, half_b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Real roots of a t^2 + 2 half_b t + c, rising, (..., 2); infinite where there are fewer.

    The larger root is found first and the other from the product of both, so that nothing cancels; a = 0 is a line.

    Examples
    --------
    >>> quadratic_roots(1.0, -0.5e8, 1.0).tolist() == [1e-8, 1e8]
    True
    >>> quadratic_roots(0.0, -1.0, 4.0).tolist(), quadratic_roots(1.0, 0.0, 1.0).tolist()
    ([2.0, inf], [inf, inf])
    """
    a, half_b, c = np.broadcast_arrays(*(np.asarray(v, float) for v in (a, half_b, c)))
    discriminant = half_b**2 - a * c
    with np.errstate(all="ignore"):
        large = -(half_b + np.copysign(np.sqrt(np.maximum(discriminant, 0.0)), half_b))
        found = np.stack([np.where(a != 0, large / a, np.inf), np.where(large != 0, c / large, 0.0)], -1)
    none = (discriminant < 0) | ((a == 0) & (half_b == 0))
    found = np.where(none[..., None] | ~np.isfinite(found), np.inf, found)
    return np.sort(found, axis=-1)


def real_roots(coefficients: np.ndarray) -> np.ndarray:
    """Real roots of polynomials, rising, (..., n); infinite where there are fewer than the degree n.

    Between two neighbouring roots of its derivative a polynomial has one root or none, by its signs there; so roots
    that nearly coincide are told from none as well as its values are known. Each is bracketed and halved.

    Parameters
    ----------
    coefficients : ndarray, shape (..., n + 1)
        The highest power first; at least quadratic; the leading one not 0.

    Examples
    --------
    >>> real_roots(np.poly([1.0, 1.0, 2.0, 5.0])).round(6).tolist()
    [1.0, 1.0, 2.0, 5.0]
    >>> real_roots(np.array([1.0, 0, 0, 0, 1.0])).tolist()
    [inf, inf, inf, inf]
    """
    coefficients = np.asarray(coefficients, float)
    degree = coefficients.shape[-1] - 1
    if degree == 2:
        return quadratic_roots(coefficients[..., 0], coefficients[..., 1] / 2, coefficients[..., 2])
    turns = real_roots(coefficients[..., :-1] * np.arange(degree, 0, -1))
    bound = 1 + np.abs(coefficients[..., 1:] / coefficients[..., :1]).max(-1, keepdims=True)  # Cauchy's
    ends = np.concatenate([-bound, np.minimum(np.maximum(turns, -bound), bound), bound], -1)
    values = _value(coefficients, ends)
    sign = np.sign(np.where(np.abs(values) <= _rounding(coefficients, ends), 0.0, values))
    low, high = ends[..., :-1], ends[..., 1:]
    crossing = sign[..., :-1] * sign[..., 1:] < 0
    found = np.where(crossing, _halved(coefficients, low, high, sign[..., :-1]), np.inf)
    touching = (sign[..., 1:-1] == 0) & np.isfinite(turns)
    twice = np.concatenate([found, *(np.where(touching, turns, np.inf) for _ in range(2))], -1)
    return np.sort(twice, axis=-1)[..., :degree]


def _value(coefficients: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Values at t (..., k) by Horner's rule."""
    found = np.zeros_like(t)
    for k in range(coefficients.shape[-1]):
        found = found * t + coefficients[..., k : k + 1]
    return found


def _rounding(coefficients: np.ndarray, t: np.ndarray) -> np.ndarray:
    """What rounding may make of `_value`."""
    return _EXACT * _value(np.abs(coefficients), np.abs(t))


def _halved(coefficients: np.ndarray, low: np.ndarray, high: np.ndarray, sign: np.ndarray) -> np.ndarray:
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        left = _value(coefficients, middle) * sign > 0
        low, high = np.where(left, middle, low), np.where(left, high, middle)
    slopes, found = coefficients[..., :-1] * np.arange(coefficients.shape[-1] - 1, 0, -1), (low + high) / 2
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON):
            step = found - _value(coefficients, found) / _value(slopes, found)
            found = np.where((step >= low) & (step <= high), step, found)
    return found
