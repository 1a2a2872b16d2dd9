"""How distances on a plane of the part move with corners on it, and these with the lines of edges in the image.

The first is a constant of the part, found by the measurands' own formulas from places that are moved one by one; the
second depends on the eye.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.certifying.enclosed import Enclosed
from scenes import Corner, Edge, Quantity, Scene, Solid
from scenes.measurands.evaluated import Point
from scenes.measurands.features import plane_of, point_of, points_of
from scenes.measurands.kinds import MEASURANDS

if TYPE_CHECKING:
    from planner.certifying.lines import Line as Image
    from planner.certifying.view import View

_NONE = 1e-12  # of the largest: a place that moves nothing


@dataclass(frozen=True, eq=False)
class Pull:
    """A place, and how a quantity moves with it.

    Attributes
    ----------
    place : ndarray, shape (3,)
    edges : tuple of str
        The two whose lines decide where it is found.
    slope : ndarray, shape (3,)
        Derivative of the quantity by the place, its unit for the scene's.
    across : ndarray, shape (3,), or None
        Unit normal of the plane; None where that turns to the eye about the slope.
    middle : ndarray, shape (3,)
        The place that then decides how it turns.
    """

    place: np.ndarray
    edges: tuple[str, ...]
    slope: np.ndarray
    across: np.ndarray | None
    middle: np.ndarray

    def by_line(self, view: View, edge: Edge) -> Enclosed:
        """Derivative of the quantity by the displacement of an edge's line beside the place, its unit for px, over the
        edge's h.

        On the plane of unit normal N a place moves along b N.w - w N.b where the line of the other edge, direction b,
        stays.
        """
        solid, camera = view.scene.solid, view.scene.camera
        own = solid.vertices[edge.ends[1]] - solid.vertices[edge.ends[0]]
        own = own / np.linalg.norm(own)
        over = view.divisor(self.place) / camera.focal_px
        beside = solid.edge(next(name for name in self.edges if name != edge.name))
        other = solid.vertices[beside.ends[1]] - solid.vertices[beside.ends[0]]
        other = other / np.linalg.norm(other)
        shift = over * (-self._lean(view, other) + float(self.slope @ other))
        return shift / view.over(self.place, other, own, (beside, edge))

    def _lean(self, view: View, other: np.ndarray) -> Enclosed:
        """slope . w  N . b / N . w of a direction b; 0 where it lies in the plane."""
        if self.across is not None:
            off = float(self.across @ other)
            off = 0.0 if abs(off) < _NONE else off
            return view.from_eye(self.place, self.slope * off) / view.from_eye(self.place, self.across)
        unit = self.slope / np.linalg.norm(self.slope)
        square = np.eye(3) - np.outer(unit, unit)  # N = (1 - u u) w of the middle, u the slope's direction
        off = view.from_eye(self.middle, square @ other)
        facing = [view.from_eye(self.middle, row) * view.from_eye(self.place, row) for row in _axes(unit)]
        return view.from_eye(self.place, self.slope) * off / (facing[0] + facing[1])

    def back(self, view: View) -> list[Enclosed]:
        """Derivative of the quantity by where the place seems to be in space, whose image is taken back to the plane:
        slope - N (slope.w) / (N.w)."""
        lean = view.from_eye(self.place, self.slope)
        if self.across is not None:
            lean = lean / view.from_eye(self.place, self.across)
            return [lean * -float(n) + float(s) for n, s in zip(self.across, self.slope, strict=True)]
        unit = self.slope / np.linalg.norm(self.slope)
        rows = _axes(unit)
        facing = [view.from_eye(self.middle, row) for row in rows]
        over = [part * view.from_eye(self.place, row) for part, row in zip(facing, rows, strict=True)]
        lean = lean / (over[0] + over[1])
        normal = [facing[0] * float(a) + facing[1] * float(b) for a, b in rows.T]
        return [-(lean * n) + float(s) for n, s in zip(normal, self.slope, strict=True)]

    def shares(self, line: Image) -> tuple[float, float]:
        """Of a displacement beside the place the derivatives by those of the edge's ends."""
        solid = line.view.scene.solid
        last = solid.vertices[line.edge.ends[1]]
        is_last = np.linalg.norm(last - self.place) < 1e-9 * solid.extent
        return (0.0, 1.0) if is_last else (1.0, 0.0)


def _axes(unit: np.ndarray) -> np.ndarray:
    """Two unit vectors square to one and to each other, (2, 3)."""
    return np.linalg.svd(unit[None])[2][1:]


class Moved:
    """Corners where an object has them, whose places all move: each by three parameters of its own."""

    def __init__(self, solid: Solid) -> None:
        self.solid = solid
        self.places: list[tuple[np.ndarray, tuple[str, ...]]] = []

    def point(self, feature: Corner, plane: np.ndarray | None) -> Point:
        """A corner."""
        self.places.append((point_of(self.solid, feature), tuple(feature.edges)))
        first = 3 * (len(self.places) - 1)
        return Point(self.places[-1][0], {first + k: row for k, row in enumerate(np.eye(3))})


def pulls_of(scene: Scene, quantity: Quantity) -> list[Pull]:
    """How a distance of corners moves with their places."""
    across, points = plane_of(scene.solid, quantity), points_of(scene.solid, quantity)
    moved = Moved(scene.solid)
    told = MEASURANDS[quantity.kind].evaluated(moved, quantity, across)
    rows = np.zeros(3 * len(moved.places))
    for number, slope in told.gradient.items():
        rows[number] = float(slope)
    slopes = rows.reshape(-1, 3)
    if across is not None:
        slopes = slopes - (slopes @ across)[:, None] * across
    most = np.linalg.norm(slopes, axis=1).max(initial=0.0)
    return [
        Pull(*place, slope, across, points.mean(0))
        for place, slope in zip(moved.places, slopes, strict=True)
        if np.linalg.norm(slope) > _NONE * most
    ]


def is_known(scene: Scene) -> bool:
    """Whether all quantities are distances of corners: those of which bounds have been shown to hold."""
    return all(
        each.kind == "distance" and all(isinstance(feature, Corner) for feature in each.features)
        for each in scene.quantities
    )
