"""Light that plane faces send to each other, in large images: over a pixel that no edge crosses it is even.

A whole pixel's rays, spread over it together, tell that light by fewer of them than those of each of its fine pixels.
Where nothing is measured, rays of every eighth pixel do, straight lines between them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import map_coordinates

if TYPE_CHECKING:
    from render.large import Counts, Renders

_ALIKE = 0.75  # of the rays of a pixel's fine ones, each way: as noisy as those (bracket_mm: 0.756)
_FEWER = 2  # times fewer rays, each way, where noise moves no edge
_APART = 8  # pixels between those whose rays stand for what lies between them
_MORE = 2  # times more rays of those, each way


@dataclass(frozen=True, eq=False)
class Even:
    """Where light between plane faces may be seen, and where it is even.

    Attributes
    ----------
    lent_to : callable
        Mask of whole pixels to those of them that it may be seen in.
    crossed : callable
        () to the mask of whole pixels that an edge of a body may cross.
    """

    lent_to: Callable[[np.ndarray], np.ndarray]
    crossed: Callable[[], np.ndarray]


@dataclass(frozen=True, eq=False)
class Zones:
    """Masks of whole pixels.

    Attributes
    ----------
    lent : ndarray of bool
        Where light between faces may be seen.
    near : ndarray of bool
        Where something is measured from, and ...
    moving : ndarray of bool
        ... where noise moves it.
    """

    lent: np.ndarray
    near: np.ndarray
    moving: np.ndarray


def with_light_between(
    renders: Renders, even: Even, first: np.ndarray, fine: np.ndarray, zones: Zones, marked: np.ndarray, counts: Counts
) -> np.ndarray:
    """The image with light between faces in all fine pixels but the marked ones.

    Parameters
    ----------
    renders : Renders
    even : Even
    first : ndarray
        Direct light in whole pixels.
    fine : ndarray
        Direct light in fine pixels; changed in place.
    zones : Zones
    marked : ndarray of bool
        Fine pixels that an edge crosses.
    counts : Counts
    """
    k, few, close_by = renders.supersample, counts.few, counts.near
    plain = zones.lent & ~even.crossed() & ~some_of(marked, k)
    many = max(round(_ALIKE * k * math.sqrt(close_by)), 1)
    parts = [
        (plain & zones.near & zones.moving, many**2),
        (plain & zones.near & ~zones.moving, max(many // _FEWER, 1) ** 2),
    ]
    far = zones.lent & ~zones.near
    if far.any():
        nodes, between = _nodes(plain, far)
        fine = _taken(fine, first + _between(renders, first, nodes, few), between, k)
        parts.append((far & ~between, few))
    for where, rays in parts:
        fine = _taken(fine, renders.whole(True, rays, where), where, k) if where.any() else fine
    uneven = fine_of(zones.near & zones.lent & ~plain, k) & ~marked
    return renders.again(True, fine, uneven, close_by) if uneven.any() else fine


def _nodes(plain: np.ndarray, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels whose rays stand for others (by rows and columns of nodes), and the asked ones that lie between them."""
    rows, columns = ((size - 1) // _APART for size in plain.shape)
    cells = np.ones((rows, columns), bool)
    wanted = np.zeros((rows, columns), bool)
    for y in range(_APART + 1):
        for x in range(_APART + 1):
            there = slice(y, y + rows * _APART, _APART), slice(x, x + columns * _APART, _APART)
            cells &= plain[there]
            wanted |= asked[there]
    cells &= wanted
    nodes = np.zeros((rows + 1, columns + 1), bool)
    for y in (0, 1):
        for x in (0, 1):
            nodes[y : y + rows, x : x + columns] |= cells
    between = np.zeros(plain.shape, bool)
    between[: rows * _APART, : columns * _APART] = cells.repeat(_APART, 0).repeat(_APART, 1)
    return nodes, between & asked


def _between(renders: Renders, first: np.ndarray, nodes: np.ndarray, few: int) -> np.ndarray:
    """Light between faces at all pixels, by straight lines between the nodes; 0 where there is none."""
    where = np.zeros(first.shape, bool)
    at = tuple(slice(0, size * _APART, _APART) for size in nodes.shape)
    where[at] = nodes
    light = np.where(where, renders.whole(True, few * _MORE**2, where) - first, 0.0)[at]
    places = np.indices(first.shape) / _APART
    return map_coordinates(light, places, order=1, mode="nearest")


def _taken(fine: np.ndarray, pixels: np.ndarray, where: np.ndarray, supersample: int) -> np.ndarray:
    """The fine image with that of whole pixels where a mask of them says so, changed in place."""
    height, width = where.shape
    blocks = fine.reshape(height, supersample, width, supersample).swapaxes(1, 2)
    blocks[where] = pixels[where][:, None, None]
    return fine


def fine_of(pixels: np.ndarray, supersample: int) -> np.ndarray:
    """Fine pixels of whole ones, a mask or in single precision, which takes half the memory."""
    kind = bool if pixels.dtype == bool else np.float32
    return pixels.astype(kind).repeat(supersample, 1).repeat(supersample, 0)  # the slow one of fewer


def some_of(fine: np.ndarray, supersample: int) -> np.ndarray:
    """Whole pixels one of whose fine ones is marked."""
    rows = reduce(np.logical_or, (fine[k::supersample] for k in range(supersample)))
    return reduce(np.logical_or, (rows[:, k::supersample] for k in range(supersample)))
