"""Is what a fit leaves of photographs their noise? Asked of edges, of what is smooth, and of a camera's curve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import fdtr, fdtrc

from measure.fitting.photograph import Pixels

_EDGE = 2.0  # standard deviations of noise by which the model differs between neighbours at an edge
_BLOCK = 4  # px
_TOLD = 1e-9  # of a direction's square: what is left of less is rounding
_LEAST = 0.5  # degrees of freedom that are looked at
_EXACT = 1e9  # degrees of freedom of a noise that is known


class Part(NamedTuple):
    """Sum of squares of whitened residuals, and what is expected of it."""

    squares: float
    freedom: float


def p_value(parts: list[Part], noise_freedom: float) -> float:
    """Probability of residuals at least as unlikely in any part, two-sided; F-tests, for the noise is estimated too."""
    each = []
    for part in parts:
        if part.freedom >= _LEAST:
            ratio, against = part.squares / part.freedom, min(noise_freedom, _EXACT)
            tails = [tail(part.freedom, against, ratio) for tail in (fdtr, fdtrc)]
            each.append(min(2 * min(tails), 1.0))
    if not each:
        return float("nan")
    return float(-np.expm1(len(each) * np.log1p(-min(min(each), 1 - 1e-16))))


def parts(
    white: np.ndarray, model: np.ndarray, level: np.ndarray, pixels: tuple[Pixels, ...],
    jacobian: np.ndarray, covariance: np.ndarray,
) -> list[Part]:  # fmt: skip
    """Whitened residuals (P,) at edges, their sums over blocks of 4 x 4 px, and what a curved response would leave.

    Parameters
    ----------
    white, model : ndarray, shape (P,)
        Residual, and expected level, over the noise's standard deviation.
    level : ndarray, shape (P,)
        Expected level.
    jacobian : ndarray, shape (P, f)
        Whitened too; with the ``covariance`` (f, f) of the parameters it says what the fit takes out of the squares.
    """
    edges, rows = [], []
    for k, part in enumerate(pixels):
        here = slice(sum(each.x.size for each in pixels[:k]), sum(each.x.size for each in pixels[: k + 1]))
        edges.append(_edges(model[here].reshape(part.shape)).ravel())
        rows.append(_sums(np.concatenate([white[here, None], jacobian[here]], 1), part.shape))
    edge, blocks = np.concatenate(edges), np.concatenate(rows)
    return [
        _part(white[edge], jacobian[edge], covariance),
        _part(blocks[:, 0], blocks[:, 1:], covariance),
        _curved(white, model, level, jacobian, covariance),
    ]


def _curved(white, model, level, jacobian, covariance) -> Part:
    """Score test of gamma: the residual along the derivative of level^gamma, at right angles to all parameters."""
    share = np.maximum(level, 1e-9) / max(float(level.max()), 1e-9)
    along = np.maximum(model, 0.0) * np.log(np.maximum(share, 1e-9))
    across = along - jacobian @ (covariance @ (jacobian.T @ along))
    size = float(across @ across)
    if size <= _TOLD * float(along @ along):
        return Part(0.0, 0.0)
    return Part(float(across @ white) ** 2 / size, 1.0)


def _part(residual: np.ndarray, jacobian: np.ndarray, covariance: np.ndarray) -> Part:
    return Part(
        float(residual @ residual), residual.size - float(np.einsum("pi,ij,pj->", jacobian, covariance, jacobian))
    )


def _edges(level: np.ndarray) -> np.ndarray:
    """Pixels (T, height, width) whose neighbours in their rectangle are far from them."""
    found = np.zeros(level.shape, bool)
    down, right = (np.abs(np.diff(level, axis=axis)) > _EDGE for axis in (1, 2))
    found[:, :-1] |= down
    found[:, 1:] |= down
    found[:, :, :-1] |= right
    found[:, :, 1:] |= right
    return found


def _sums(columns: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """Sums of columns (P, c) over blocks, over the square root of their pixels, (blocks, c)."""
    count, height, width = shape[0], shape[1] // _BLOCK, shape[2] // _BLOCK
    whole = columns.reshape(*shape, -1)[:, : height * _BLOCK, : width * _BLOCK]
    return whole.reshape(count, height, _BLOCK, width, _BLOCK, -1).sum((2, 4)).reshape(-1, columns.shape[1]) / _BLOCK
