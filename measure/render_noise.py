"""How far measured values scatter by the noise of renders: from few renders that differ by rays alone.

A few values tell their scatter badly; two agree by chance. Where rays are random pixel by pixel, the renders' pixels
tell it: each part of the image moves a value by its pixels' deviations times the value's derivatives by them, and there
are many parts. Where the same random numbers serve all pixels, parts of the image move together; then all lines and
circles are taken as one sample, each in units of its standard deviation by the camera's noise.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse

from measure.quantities import MeasuredFeatures

_LEAST, _APART = 4, 4.0  # side of a part, px, and in standard deviations of the lens's blur


def by_pixels(renders: np.ndarray, response: sparse.csr_array, blur_px: float) -> np.ndarray:
    """Standard deviations of values by the noise of one render, from renders whose rays are random pixel by pixel.

    The square parts of the image are as large as blur lets their noise go together: what neighbours have in common is
    counted, what lies farther apart is independent.

    Parameters
    ----------
    renders : ndarray, shape (n, height, width)
        Levels as recorded; two at least.
    response : csr_array, shape (M, height * width)
        Derivatives of the values by the pixels.
    blur_px : float
        Standard deviation of the lens's blur, px.

    Returns
    -------
    ndarray, shape (M,)
        0 of a value that depends on no pixel.
    """
    count, height, width = renders.shape
    side = max(_LEAST, math.ceil(_APART * blur_px))
    used = np.unique(response.indices)
    rows, columns = np.divmod(used, width)
    shape = -(-height // side), -(-width // side)
    part = rows // side * shape[1] + columns // side
    into = sparse.csr_array((np.ones(len(used)), (np.arange(len(used)), part)), (len(used), math.prod(shape)))
    taken = renders.reshape(count, -1)[:, used]
    derivatives, squares = response[:, used], np.zeros(response.shape[0])
    for away in taken - taken.mean(0):
        moved = (derivatives.multiply(away).tocsr() @ into).toarray().reshape(-1, *shape)
        squares += np.fmax((moved * _with_neighbours(moved)).sum((1, 2)), 0.0)
    return np.sqrt(squares / (count - 1))


def _with_neighbours(parts: np.ndarray) -> np.ndarray:
    """Sums of each part and its eight neighbours, (M, rows, columns)."""
    for axis in (1, 2):
        wide = np.pad(parts, [(1, 1) if k == axis else (0, 0) for k in range(3)])
        size = parts.shape[axis]
        parts = sum(np.take(wide, range(k, k + size), axis) for k in range(3))
    return parts


def by_features(found: MeasuredFeatures, alike: int) -> float:
    """Scatter of lines and circles over the first images, which differ by rays alone, over that by the camera's noise.

    Root mean square of all their parameters, each feature's made independent by its own covariance; 0 of one image,
    infinite where no feature is found in all of them.
    """
    shape, features = found.shape, []
    across = np.stack([-shape.normals[..., 1], shape.normals[..., 0]], -1)
    offset = np.einsum("nej,ej->ne", shape.points - shape.points[0], shape.normals[0])
    turn = np.einsum("nej,ej->ne", shape.normals, across[0])
    for e in range(shape.normals.shape[1]):
        some = slice(2 * e, 2 * e + 2)
        features.append((np.stack([offset[:, e], turn[:, e]], -1), shape.lines[0, some, some]))
    features += [(circle.errors, circle.covariance[0]) for circle in found.circles]
    squares, count = 0.0, 0
    for moved, covariance in features:
        if alike > 1 and np.isfinite(moved[:alike]).all() and np.isfinite(covariance).all():
            away = moved[:alike] - moved[:alike].mean(0)
            squares += float(np.einsum("ni,ij,nj", away, np.linalg.pinv(covariance, hermitian=True), away))
            count += away.shape[1] * (alike - 1)
    return float(np.sqrt(squares / count)) if count else (0.0 if alike == 1 else np.inf)
