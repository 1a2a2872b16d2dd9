"""Traces of JPEG: what its blocks of 8 x 8 pixels leave in a picture, whatever file it comes in."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

BLOCK = 8  # px
_BLOCKS = 1500  # looked at for each place of the grid
_FINEST = 0.75  # of a level's step: coefficients below it are taken for zero
_CLEAR = 8.0  # standard errors by which one grid must have more zeros than the others
_MUCH = 0.01  # part of all coefficients that these must be


def is_compressed(image: np.ndarray, step: float = 1.0) -> bool:
    """Whether an image (height, width) was compressed by JPEG, its grid of blocks anywhere.

    Compression rounds the cosine coefficients of each block, most of them to zero. Of the 64 grids on which blocks may
    lie the right one shows more coefficients next to zero than all others; ``step`` is that of the grey levels. Without
    rounded levels there is no grid: the picture is nobody's file.

    Examples
    --------
    >>> import cv2
    >>> noisy = np.clip(np.random.default_rng(1).normal(90, 4, (160, 160)), 0, 255).astype(np.uint8)
    >>> packed = cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, 90])[1]
    >>> is_compressed(cv2.imdecode(packed, 0)[3:, 5:]), is_compressed(noisy)
    (True, False)
    """
    if step <= 0 or min(image.shape) < 4 * BLOCK:
        return False
    zeros, count = _zeros(image, _FINEST * step)
    best = int(np.argmax(zeros))
    rest = np.delete(zeros, best)
    error = np.sqrt(max(float(rest.mean()) * (1 - float(rest.mean())), 1e-6) / count)
    return bool(zeros[best] - rest.max() > max(_CLEAR * error, _MUCH))


def _zeros(image: np.ndarray, least: float) -> tuple[np.ndarray, int]:
    """Part of the coefficients that are next to zero, for each place of the grid (64,), and how many were looked at."""
    found = []
    for top in range(BLOCK):
        for left in range(BLOCK):
            blocks = _blocks(image, top, left)
            found.append((np.abs(blocks @ _cosines()) < least).mean())
    return np.array(found), blocks.shape[0] * (BLOCK**2 - 1)


def _blocks(image: np.ndarray, top: int, left: int) -> np.ndarray:
    rows, columns = ((size - BLOCK + 1) // BLOCK for size in image.shape)
    step = max(rows * columns // _BLOCKS, 1)
    bands = range(step // 2 % rows, rows, step)
    cut = [
        image[top + BLOCK * row :][:BLOCK, left : left + columns * BLOCK].reshape(BLOCK, -1, BLOCK).swapaxes(0, 1)
        for row in bands
    ]
    return np.concatenate(cut).reshape(-1, BLOCK**2).astype(np.float32)


@lru_cache(maxsize=1)
def _cosines() -> np.ndarray:
    """From a block's pixels to its coefficients but the mean, (64, 63)."""
    places = np.arange(BLOCK)
    one = np.cos(np.pi * np.outer(places + 0.5, places) / BLOCK) * np.sqrt(np.where(places == 0, 1, 2) / BLOCK)
    return np.kron(one, one)[:, 1:].astype(np.float32)
