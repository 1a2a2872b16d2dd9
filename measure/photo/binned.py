"""A photograph in larger pixels: where long sides are blurred over many, mean levels of squares of them tell the same.

A pixel's own box adds 1/12 px^2 to the blur's variance; where the blur is wide in the larger pixels too, hardly any
precision is lost, and noise that neighbours shared is nearer to white.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from imaging.models.reach import is_long
from measure.photo.profiles import edge_sigma
from scenes.photograph import Photograph

_SHARP = 0.75  # px of blur that is left at the least: a box adds 1/12 px^2, and 2.6 % to the standard deviation


def bin_size(image: np.ndarray, corners: np.ndarray) -> int:
    """How many pixels in a row make a larger one that does for a quadrilateral with these corners (4, 2), px.

    1 where its sides are sharp or short.
    """
    blur = edge_sigma(image, corners)
    length = float(np.linalg.norm(corners - np.roll(corners, -1, 0), axis=1).sum())
    return max(int(blur / _SHARP), 1) if is_long(length, blur) else 1


def binned(photo: Photograph, size: int, compressed: bool) -> Photograph:
    """Mean levels of squares of ``size`` x ``size`` px; what is left at the right and at the bottom is cut off."""
    height, width = (n // size * size for n in photo.levels.shape)
    levels = cv2.resize(
        photo.levels[:height, :width].astype(float), (width // size, height // size), interpolation=cv2.INTER_AREA
    )
    return replace(photo, levels=levels, full=None, compressed=compressed)


def into(points: np.ndarray, size: int) -> np.ndarray:
    """Where points (..., 2), px, lie among the larger pixels, in those.

    >>> into(np.array([[0.5, 2.5]]), 2).tolist()
    [[0.0, 1.0]]
    """
    return (points + 0.5) / size - 0.5


def back(points: np.ndarray, size: int) -> np.ndarray:
    """The reverse of `into`."""
    return (points + 0.5) * size - 0.5
