"""The arithmetic that a reflectance is written in, once for any array library.

``ops`` names the functions that differ: numpy for the image model, Dr.Jit within the renderer, mpmath for references of
50 digits. Vectors are tuples of three components, so that one text serves all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

Vector = tuple[Any, Any, Any]


class Ops(NamedTuple):
    """The functions that array libraries spell differently, and two numbers of their precision.

    ``tiny`` is so small that nothing is lost by taking it for 0, and its inverse can be formed; below ``flat`` the
    squared sine of the angle between two directions is rounding.
    """

    sqrt: Callable
    exp: Callable
    log: Callable
    minimum: Callable
    maximum: Callable
    select: Callable
    tiny: Any = 1e-300
    flat: Any = 1e-26
    pi: Any = math.pi


NUMPY = Ops(np.sqrt, np.exp, np.log, np.minimum, np.maximum, np.where)


def across(axis: Vector, beam: Vector, ops: Ops = NUMPY) -> Vector:
    """The direction across ``beam`` nearest to ``axis``: how a linear polariser of that axis acts on a slanted ray."""
    along = dot(axis, beam)
    return unit(ops, tuple(x - along * y for x, y in zip(axis, beam, strict=True)))


def components(vectors: np.ndarray) -> Vector:
    """Of an array of vectors (..., 3)."""
    vectors = np.asarray(vectors, float)
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]


def dot(a: Vector, b: Vector):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (...) of vectors (..., 3): a component at a time, which is several times as fast as along an axis
    of three."""
    return dot(components(a), components(b))


def length(vectors: np.ndarray) -> np.ndarray:
    """Lengths (...) of vectors (..., 3)."""
    return np.sqrt(product(vectors, vectors))


def chosen(vectors: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Those (n, 3) of vectors (..., 3) that are chosen, bool (...): by their numbers, which is several times as fast as
    NumPy's own way."""
    return np.reshape(vectors, (-1, 3)).take(np.flatnonzero(which), 0)


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(ops: Ops, a: Vector) -> Vector:
    """The vector at length 1; one shorter than the root of ``ops.tiny`` stays short."""
    size = ops.sqrt(ops.maximum(dot(a, a), ops.tiny))
    return a[0] / size, a[1] / size, a[2] / size
