"""Coordinates along and across one expected edge, and the part of it where edge points are sought."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.features.locator import MIN_USABLE
from imaging.features.projected_edges import trim_beside
from imaging.geometry.segments import distance_to_segment
from measure.features.layout import Layout
from measure.features.optics import Optics
from scenes import status

MIN_POSITIONS = 3


@dataclass(frozen=True, eq=False)
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
        Places along the edge, at most 1 px apart, where it can be measured: the trimmed corners, what lies outside the
        image and what does not stand out of the noise are left out.
    status : str
        ``ok``, ``clutter``, ``short`` or ``not_visible``, as far as geometry alone tells.
    optics : Optics
    defocus : ndarray, shape (2,)
        Signed radius of the circle of confusion at both ends, px.
    """

    name: str
    origin: np.ndarray
    direction: np.ndarray
    length: float
    positions: np.ndarray
    status: str
    optics: Optics
    defocus: np.ndarray

    @property
    def normal(self) -> np.ndarray:
        return np.array([-self.direction[1], self.direction[0]])

    def blur(self, along: np.ndarray) -> np.ndarray | float:
        """Standard deviation of the lens' blur at places along the edge, px."""
        blur = self.optics.blur_px
        if self.optics.field is not None:
            blur = self.optics.blur_at(self.optics.recorded(self.at(np.asarray(along), np.zeros(np.shape(along)))))
        if not self.defocus.any():
            return blur
        start, stop = self.defocus
        return np.sqrt(blur**2 + (start + (stop - start) * along / self.length) ** 2 / 4)

    def curve(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The edge as it is recorded at the positions: places (m, 2), px, unit normals (m, 2), and ideal px across the
        edge for a recorded px (m,)."""
        places = self.at(self.positions, np.zeros(1))
        gradient = self.optics.gradient(places, self.normal)
        size = np.linalg.norm(gradient, axis=-1)
        return self.optics.recorded(places), gradient / size[:, None], size

    def at(self, along: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Ideal image coordinates (x, y), px, of places in this caliper."""
        return self.origin + along[..., None] * self.direction + offset[..., None] * self.normal

    def coordinates(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(along, offset) of image points (..., 2) in ideal coordinates, px."""
        away = points - self.origin
        return away @ self.direction, away @ self.normal


def edge_calipers(layout: Layout, clear: float, margin: float, crowd: float | None = None) -> tuple[Caliper, ...]:
    """A caliper for each edge of a layout.

    Parameters
    ----------
    layout : Layout
    clear : float
        How far every other edge must be from the part that is used, px.
    margin : float
        How far from the image's border a position must be, px.
    crowd : float, optional
        How near an edge that shares no corner makes it ``clutter``, px. When not given, what the planner says, or
        ``clear`` where the light is not known.
    """
    return tuple(_caliper(layout, i, clear, margin, crowd) for i in range(len(layout.names)))


def _caliper(layout: Layout, i: int, clear: float, margin: float, crowd: float | None) -> Caliper:
    start, stop = layout.ends[i]
    length = float(np.linalg.norm(stop - start))
    if not layout.visible[i] or not length > 0:
        nowhere = np.zeros(2), np.array([1.0, 0.0]), 0.0, np.empty(0)
        return Caliper(layout.names[i], *nowhere, status.NOT_VISIBLE, layout.optics, np.zeros(2))
    along = (stop - start) / length
    shown = length * layout.shown[i]
    first = max(trim(along, layout.beside[i][0], clear), shown[0] + clear if shown[0] > 0 else 0.0)
    last = length - max(
        trim(-along, layout.beside[i][1], clear), length - shown[1] + clear if shown[1] < length else 0.0
    )
    if layout.strong is not None:
        first, last = max(first, length * layout.strong[i, 0]), min(last, length * layout.strong[i, 1])
    positions = np.linspace(first, last, int(np.ceil(last - first)) + 1) if last >= first + MIN_USABLE else np.empty(0)
    places = start + positions[:, None] * along
    size = np.array(layout.optics.shape[::-1])
    seen = layout.optics.recorded(places)
    inside = ((seen >= margin) & (seen <= size - 1 - margin)).all(-1)
    if positions.size < MIN_POSITIONS:
        state = status.SHORT
    elif inside.sum() < MIN_POSITIONS:
        state = status.NOT_VISIBLE
    else:
        told = crowd is None and layout.clutter is not None
        crowded = layout.clutter[i] if told else _crowded(layout, i, places[inside], clear if crowd is None else crowd)
        state = status.CLUTTER if crowded else status.OK
    return Caliper(layout.names[i], start, along, length, positions[inside], state, layout.optics, layout.defocus[i])


def _crowded(layout: Layout, i: int, places: np.ndarray, near: float) -> bool:
    """Whether an edge that shares no corner with the i-th is nearer than ``near`` to places (m, 2)."""
    return any(distance_to_segment(places, *other).min() < near for other in layout.apart[i])


def trim(along: np.ndarray, beside: np.ndarray, clear: float) -> float:
    """Length to leave out at an edge's end so that every edge that starts there, (k, 2), is ``clear`` px away."""
    return float(np.max(trim_beside(along, beside, clear), initial=clear))
