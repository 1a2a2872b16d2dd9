"""Which of the shapes in a photograph is meant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from measure.find.candidate import Candidate
from measure.find.search import find
from scenes import InvalidInput
from scenes.arrays import finite


def find_in(image: np.ndarray, kinds: tuple[str, ...] | None, box: Any) -> tuple[Candidate, ...]:
    """What `find` finds in a box x0, y0, x1, y1 (px) of an image, looked at by itself: finer where the image is large.

    Raises
    ------
    InvalidInput
        If the box is none, or lies outside the image.
    """
    box = finite(box, "box")
    if box.shape != (4,) or not (box[:2] < box[2:]).all():
        raise InvalidInput(f"box must be x0, y0, x1, y1 with x0 < x1 and y0 < y1, got {box.tolist()}")
    if (box[2:] < 0).any() or (box[:2] > np.array(image.shape[::-1]) - 1).any():
        raise InvalidInput(f"box must lie in the image of {_size(image)}, got {box.tolist()}")
    low = np.maximum(np.floor(box[:2]), 0).astype(int)
    high = np.minimum(np.ceil(box[2:]) + 1, image.shape[::-1]).astype(int)
    return tuple(one.moved(low) for one in find(image[low[1] : high[1], low[0] : high[0]], kinds))


def nearest(found: Sequence[Candidate], image: np.ndarray, point: Any) -> tuple[Candidate, ...]:
    """The smallest shape around a point (x, y), px, or else the nearest one, if there is any.

    Raises
    ------
    InvalidInput
        If the point lies outside the image.
    """
    point = finite(point, "near")
    if point.shape != (2,) or (point < 0).any() or (point > np.array(image.shape[::-1]) - 1).any():
        raise InvalidInput(f"near must be x, y in the image of {_size(image)}, got {point.tolist()}")
    around = [one for one in found if one.distance(point) <= 0]
    if around:
        return (min(around, key=lambda one: one.area),)
    return tuple(sorted(found, key=lambda one: one.distance(point))[:1])


def _size(image: np.ndarray) -> str:
    return f"{image.shape[1]} x {image.shape[0]} px"
