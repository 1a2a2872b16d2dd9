"""Is what a fit leaves of photographs their noise? Asked of edges, of what is smooth, and of a camera's habits."""

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
    jacobian: np.ndarray, covariance: np.ndarray, beside: tuple[np.ndarray, ...] = (),
) -> list[Part]:  # fmt: skip
    """Whitened residuals (P,) at edges, their sums over blocks of 4 x 4 px, and what a curved response would leave.

    So much for what is not known; ``beside`` says what a camera may do besides.

    Parameters
    ----------
    white, model : ndarray, shape (P,)
        Residual, and expected level, over the noise's standard deviation.
    level : ndarray, shape (P,)
        Expected level.
    jacobian : ndarray, shape (P, f)
        Whitened too; with the ``covariance`` (f, f) of the parameters it says what the fit takes out of the squares.
    beside : tuple of ndarray, shape (P, d)
        Whitened derivatives by what is not free: score tests.
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
        _score(white, _curved(model, level), jacobian, covariance),
        *(_score(white, each, jacobian, covariance) for each in beside),
    ]


def _curved(model: np.ndarray, level: np.ndarray) -> np.ndarray:
    """The derivative of level^gamma by gamma, (P, 1)."""
    share = np.maximum(level, 1e-9) / max(float(level.max()), 1e-9)
    return (np.maximum(model, 0.0) * np.log(np.maximum(share, 1e-9)))[:, None]


def _score(white: np.ndarray, along: np.ndarray, jacobian: np.ndarray, covariance: np.ndarray) -> Part:
    """Score test: the residual along derivatives (P, d), at right angles to all parameters."""
    across = along - jacobian @ (covariance @ (jacobian.T @ along))
    told = (across**2).sum(0) > _TOLD * (along**2).sum(0)
    across = across[:, told] / np.sqrt((across[:, told] ** 2).sum(0))
    sizes, vectors = np.linalg.eigh(across.T @ across)
    kept = sizes > _TOLD
    score = (across @ vectors[:, kept] / np.sqrt(sizes[kept])).T @ white
    return Part(float(score @ score), float(score.size))


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
