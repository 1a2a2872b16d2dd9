"""Find a layout that the pose error has displaced: the shift and turn at which all expected edges meet an edge."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from measure.features.aligned import Aligned
from measure.features.layout import Layout
from measure.once import once

SEARCH = 5.0  # px to each side
_TURN = 2.0  # degrees to each side
_STEP = 0.5  # px
_PARTS = 4  # pieces of an edge whose profiles are taken separately, so that a turn can be told


def align(images: np.ndarray, layout: Layout) -> np.ndarray:
    """Shift (x, y) in px and turn in rad, shape (n, 3), of the layout in each image (n, height, width).

    Multiples of 0.5 px and 0.5 degrees: good enough for any estimator to start from.
    """
    return aligned(layout).poses(images.reshape(len(images), -1))


@once
def aligned(layout: Layout) -> Aligned:
    """What finds a layout."""
    pixels, centres = _pieces(layout)
    slope = gaussian_filter1d(np.eye(pixels.shape[1]), 1.0 / _STEP, axis=0, order=1)
    return Aligned(pixels, slope, *_candidates(layout, centres))


def _pieces(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (pieces, places, 12) along pieces of the edges at places across them.

    Second result: (edge, place along it) of each piece's centre.
    """
    height, width = layout.optics.shape
    across = np.arange(-SEARCH - 3, SEARCH + 3 + _STEP / 2, _STEP)
    pieces, centres = [], []
    for e, (start, stop) in enumerate(layout.ends):
        length = np.linalg.norm(stop - start)
        for part in range(_PARTS):
            along = length * (part + (np.arange(12) + 0.5) / 12) / _PARTS
            points = start + along[:, None] * layout.directions[e]
            places = points[None] + across[:, None, None] * layout.normals[e]
            pixel = np.rint(places).astype(int)
            pieces.append(np.clip(pixel[..., 1], 0, height - 1) * width + np.clip(pixel[..., 0], 0, width - 1))
            centres.append((e, along.mean()))
    return np.array(pieces), np.array(centres)


def _candidates(layout: Layout, centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All (shift x, shift y, turn), smallest first, and the index of the place that each piece is then at."""
    steps = np.arange(-SEARCH + 1, SEARCH - 1 + _STEP / 2, _STEP)
    turns = np.radians(np.arange(-_TURN, _TURN + 0.1, 0.5))
    x, y, turn = (part.ravel() for part in np.meshgrid(steps, steps, turns, indexing="ij"))
    order = np.argsort(x**2 + y**2 + (50 * turn) ** 2, kind="stable")
    candidates = np.stack([x, y, turn], 1)[order]
    edges = centres[:, 0].astype(int)
    points = layout.ends[edges, 0] + centres[:, 1:] * layout.directions[edges]
    lever = points - layout.ends.reshape(-1, 2).mean(0)
    swung = lever[:, 0] * layout.normals[edges, 1] - lever[:, 1] * layout.normals[edges, 0]
    offset = candidates[:, :2] @ layout.normals[edges].T + candidates[:, 2:] * swung
    half = SEARCH + 3
    return candidates, np.clip(np.rint((offset + half) / _STEP), 0, 2 * half / _STEP).astype(int)
