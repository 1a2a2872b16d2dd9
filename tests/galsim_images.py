"""Exact images by another maker, GalSim, and the Cramer-Rao bounds of what is in them.

Everything is done in Fourier space there, from the shapes' own transforms: nothing is shared with our images. With the
parameters below a pixel is right to 1e-8 of the contrast.
"""

from __future__ import annotations

import galsim
import numpy as np

_EXACT = galsim.GSParams(
    folding_threshold=1e-6, maxk_threshold=1e-10, kvalue_accuracy=1e-12, xvalue_accuracy=1e-12, maximum_fft_size=16384
)
_STEP = 1e-3  # px of the finite differences


def box(width: float, height: float, degrees: float, centre, shape: tuple[int, int], blur: float) -> np.ndarray:
    """Part of each pixel (height, width) that a turned rectangle fills; lengths px, (0, 0) the first pixel's centre."""
    body = galsim.Box(width, height, flux=width * height, gsparams=_EXACT).rotate(degrees * galsim.degrees)
    return _drawn(body, centre, shape, blur)


def parallelogram(corners: np.ndarray, shape: tuple[int, int], blur: float) -> np.ndarray:
    """Part of each pixel that a parallelogram (4, 2), px, fills."""
    (ax, ay), (bx, by) = corners[1] - corners[0], corners[3] - corners[0]
    square = galsim.Box(1.0, 1.0, gsparams=_EXACT)
    body = galsim.Transform(square, jac=(ax, bx, ay, by), gsparams=_EXACT).withFlux(abs(ax * by - ay * bx))
    return _drawn(body, corners.mean(0), shape, blur)


def ellipse(parameters, shape: tuple[int, int], blur: float) -> np.ndarray:
    """Part of each pixel that an ellipse fills: (x, y, a, b), px, and the angle of a in degrees."""
    x, y, a, b, angle = parameters
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn = np.array([[c, -s], [s, c]])
    disc = galsim.TopHat(1.0, flux=1.0, gsparams=_EXACT)
    body = galsim.Transform(disc, jac=(turn @ np.diag([a, b]) @ turn.T).ravel(), gsparams=_EXACT)
    return _drawn(body.withFlux(np.pi * a * b), (x, y), shape, blur)


def _drawn(body, centre, shape: tuple[int, int], blur: float) -> np.ndarray:
    lens, pixel = galsim.Gaussian(sigma=blur, gsparams=_EXACT), galsim.Pixel(1.0, gsparams=_EXACT)
    seen = galsim.Convolve([body, lens, pixel], gsparams=_EXACT)
    seen = seen.shift(centre[0] - (shape[1] - 1) / 2, centre[1] - (shape[0] - 1) / 2)
    return seen.drawImage(nx=shape[1], ny=shape[0], scale=1.0, method="no_pixel", dtype=float).array


def box_corners(width: float, height: float, degrees: float, centre) -> np.ndarray:
    """Corners (4, 2) of `box`, px."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    u, v = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]).T / 2
    return np.stack([c * u * width - s * v * height, s * u * width + c * v * height], 1) + centre


def ellipse_bound(parameters, shape: tuple[int, int], blur: float, ratio: float, circle: bool) -> np.ndarray:
    """Smallest covariance of (x, y, a, b, angle in rad), of (x, y, r) for a circle, px^2, at a contrast/noise.

    Free: the shape, both levels; the blur is known. An ellipse of equal axes has no angle: (x, y, a, b).
    """
    moves = np.eye(5)
    if circle:
        moves = np.array([[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 1, 0]])
    elif parameters[2] == parameters[3]:
        moves = moves[:4]
    moves = moves * [1, 1, 1, 1, np.degrees(1)] * _STEP
    parameters = np.asarray(parameters, float)
    columns = [
        (ellipse(parameters + move, shape, blur) - ellipse(parameters - move, shape, blur)) / (2 * _STEP)
        for move in moves
    ]
    return _bound([*columns, ellipse(parameters, shape, blur)], ratio)[: len(moves), : len(moves)]


def corner_bound(corners: np.ndarray, image, ratio: float) -> np.ndarray:
    """Smallest covariance of a polygon's corners (2 k, 2 k), px^2; ``image(corners)`` gives the part of each pixel.

    Free: all corners and both levels; the blur is known.
    """
    columns = []
    for move in np.eye(corners.size).reshape(-1, *corners.shape) * _STEP:
        columns.append((image(corners + move) - image(corners - move)) / (2 * _STEP))
    return _bound([*columns, image(corners)], ratio)[: corners.size, : corners.size]


def _bound(columns: list[np.ndarray], ratio: float) -> np.ndarray:
    design = np.stack([*(column.ravel() for column in columns), np.ones(columns[0].size)], 1)
    design[:, :-2] *= ratio
    return np.linalg.inv(design.T @ design)
