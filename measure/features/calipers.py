"""Coordinates along and across one expected edge, and the part of it where edge points are sought."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from measure import status
from measure.features.layout import Layout
from planner.features.locator import MIN_USABLE

MIN_POSITIONS = 3


@dataclass(frozen=True)
class Caliper:
    """Coordinates along and across one expected edge.

    A point of the image is ``origin + along * t + offset * n`` with t the unit direction and n = (-t_y, t_x).

    Attributes
    ----------
    name : str
    origin, direction : ndarray, shape (2,)
        Start of the edge's image, px, and its unit direction t.
    length : float
        Length of the edge's image, px.
    positions : ndarray, shape (m,)
        Places along the edge, at most 1 px apart, where it can be measured: the trimmed corners and what lies outside
        the image are left out.
    status : str
        ``ok``, ``clutter``, ``short`` or ``not_visible``, as far as geometry alone tells.
    """

    name: str
    origin: np.ndarray
    direction: np.ndarray
    length: float
    positions: np.ndarray
    status: str

    @property
    def normal(self) -> np.ndarray:
        return np.array([-self.direction[1], self.direction[0]])

    def at(self, along: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Image coordinates (x, y), px, of places in this caliper."""
        return self.origin + along[..., None] * self.direction + offset[..., None] * self.normal

    def coordinates(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(along, offset) of image points (..., 2), px."""
        away = points - self.origin
        return away @ self.direction, away @ self.normal


def edge_calipers(layout: Layout, clear: float, margin: float) -> tuple[Caliper, ...]:
    """A caliper for each edge of a layout.

    Parameters
    ----------
    layout : Layout
    clear : float
        How far every other edge must be from the part that is used, px.
    margin : float
        How far from the image's border a position must be, px.
    """
    return tuple(_caliper(layout, i, clear, margin) for i in range(len(layout.names)))


def _caliper(layout: Layout, i: int, clear: float, margin: float) -> Caliper:
    start, stop = layout.ends[i]
    length = float(np.linalg.norm(stop - start))
    if not layout.visible[i] or not length > 0:
        return Caliper(layout.names[i], np.zeros(2), np.array([1.0, 0.0]), 0.0, np.empty(0), status.NOT_VISIBLE)
    along = (stop - start) / length
    shown = length * layout.shown[i]
    first = max(trim(along, layout.beside[i][0], clear), shown[0] + clear if shown[0] > 0 else 0.0)
    last = length - max(
        trim(-along, layout.beside[i][1], clear), length - shown[1] + clear if shown[1] < length else 0.0
    )
    positions = np.linspace(first, last, int(np.ceil(last - first)) + 1) if last >= first + MIN_USABLE else np.empty(0)
    places = start + positions[:, None] * along
    size = np.array(layout.optics.shape[::-1])
    inside = ((places >= margin) & (places <= size - 1 - margin)).all(-1)
    if positions.size < MIN_POSITIONS:
        state = status.SHORT
    elif inside.sum() < MIN_POSITIONS:
        state = status.NOT_VISIBLE
    else:
        crowded = any(distance_to_segment(places[inside], *other).min() < clear for other in layout.apart[i])
        state = status.CLUTTER if crowded else status.OK
    return Caliper(layout.names[i], start, along, length, positions[inside], state)


def trim(along: np.ndarray, beside: np.ndarray, clear: float) -> float:
    """Length to leave out at an edge's end so that every edge that starts there is ``clear`` px away.

    clear / sin(angle) for an edge that turns towards this one, ``clear`` itself for one that turns away.
    """
    cosine, sine = beside @ along, np.abs(beside @ np.array([-along[1], along[0]]))
    towards = cosine > 0
    if not towards.any():
        return clear
    return float(np.max(clear / np.maximum(sine[towards], 1e-12)))


def distance_to_segment(points: np.ndarray, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Distance of points (..., 2) from a segment, px."""
    along = stop - start
    fraction = np.clip((points - start) @ along / max(float(along @ along), np.finfo(float).tiny), 0, 1)
    return np.linalg.norm(points - start - fraction[..., None] * along, axis=-1)
