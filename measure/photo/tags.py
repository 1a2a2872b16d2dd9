"""A tag's black square without its cells: an image in which it is a plain quadrilateral."""

from __future__ import annotations

import cv2
import numpy as np

from measure.find.tags import FAMILIES

_LEFT = 0.6  # of the border's width that is left as it is


def plain(image: np.ndarray, corners: np.ndarray, family: str, noise: float) -> np.ndarray:
    """The image with what lies inside a tag's black border painted over.

    The inside, from 0.6 of the border's width on, gets the border's median level and white noise, the same on each
    call. The square's outer edges then are what the estimators expect: nothing is near them.

    Parameters
    ----------
    image : ndarray, shape (height, width)
    corners : ndarray, shape (4, 2)
        Of the black square, (x, y), px.
    family : str
        Of `FAMILIES`: how many cells there are.
    noise : float
        Standard deviation of a grey level.
    """
    cells = FAMILIES[family] + 2
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    to_image = cv2.getPerspectiveTransform(square, corners.astype(np.float32))
    low = np.maximum(np.floor(corners.min(0)), 0).astype(int)
    high = np.ceil(corners.max(0)).astype(int) + 1
    y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
    u, v = np.moveaxis(cv2.perspectiveTransform(np.stack([x, y], -1).astype(float), np.linalg.inv(to_image)), -1, 0)
    depth = np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v)) * cells
    made = image.copy()
    part = made[low[1] : high[1], low[0] : high[0]]
    border, inside = (depth > 0.4) & (depth < _LEFT), depth >= _LEFT
    fill = np.median(part[border]) + noise * np.random.default_rng(0).standard_normal(int(inside.sum()))
    part[inside] = np.rint(fill) if (image[::7, ::7] == np.rint(image[::7, ::7])).all() else fill
    return made
