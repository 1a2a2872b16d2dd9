"""A part's features where an adjustment has them in space, and measurands of them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from imaging.bundles.unknowns import Unknowns
from scenes import Circle, Quantity, Side, Solid
from scenes.measurands.evaluated import Line, Point, mean
from scenes.measurands.features import Between, Centre
from scenes.measurands.kind import turn
from scenes.measurands.kinds import MEASURANDS
from scenes.viewpoint import Viewpoint


@dataclass(frozen=True, eq=False)
class InSpace:
    """Points, lines and circles with their derivatives by the unknowns; what kinds of measurands ask (`Lookup`).

    Attributes
    ----------
    unknowns : Unknowns
    numbers : ndarray, shape (n,)
        Errors of the unknowns beside what the scene says.
    viewpoint : Viewpoint
        That of a sensor, which tells the side of a plane that counts as its outside.
    turned : ndarray, shape (3, 3)
        Rotation of all places; derivatives are of those that are not turned.
    """

    unknowns: Unknowns
    numbers: np.ndarray
    viewpoint: Viewpoint
    turned: np.ndarray = field(default_factory=lambda: np.eye(3))

    expected = True

    @property
    def solid(self) -> Solid:
        """The part as the scene says it."""
        return self.unknowns.scene.solid

    def point(self, feature: Any, plane: np.ndarray | None = None) -> Point:
        """A corner, a centre or a point between others, shape (3,)."""
        if isinstance(feature, Between):
            return feature.made(self, plane)
        if isinstance(feature, Centre):
            return self.circle(feature)[1]
        return self._vertex(self.solid.vertex_names.index(feature.vertex))

    def line(self, side: Side | Between, plane: np.ndarray | None = None) -> Line:
        """That through an edge's ends, or between others."""
        if isinstance(side, Between):
            return side.made(self, plane)
        return Line(*(self._vertex(end) for end in self.solid.edge(side.edge).ends))

    def middle(self, side: Side | Between, plane: np.ndarray | None = None) -> Point:
        """Of a line."""
        line = self.line(side, plane)
        return mean([line.start, line.stop])

    def left(self, parts: tuple, plane: np.ndarray | None) -> Any:
        """As of `Seen.left`."""
        return turn(self, Quantity("", "", parts), in_space=True)

    def circle(self, feature: Centre) -> tuple[Circle, Point, np.ndarray, int]:
        """As the model has it, and found: its centre, its radius, and the number of that among the unknowns.

        The number is that of all unknowns, and stands for none, where the radius is exact.
        """
        circle, name = self.solid.circle(feature.circle), feature.circle
        found, basis = self.unknowns.full(name, self.numbers), self.unknowns.basis(name)
        centre = Point(self.turned @ (circle.centre + found[:3]), _moves(basis[:3]))
        columns = np.flatnonzero(basis[5])
        return circle, centre, np.asarray(circle.radius + found[5]), int(columns[0]) if columns.size else basis.shape[1]

    def aligned(self) -> InSpace:
        """Turned so that they lie as the model has them, as well as they can: values are those of a part that lies so.

        How all of a part lies is in its place and in its features alike, where these may lie anywhere.
        """
        there = replace(self, numbers=np.zeros(len(self.numbers))).places()
        here = self.places()
        left, _, right = np.linalg.svd((there - there.mean(0)).T @ (here - here.mean(0)))
        left[:, 2] *= np.sign(np.linalg.det(left @ right))
        return replace(self, turned=left @ right)

    def laid(self) -> np.ndarray:
        """The places (p, 3), shifted so that their middle is the model's."""
        there, here = replace(self, numbers=np.zeros(len(self.numbers)), turned=np.eye(3)).places(), self.places()
        return here + there.mean(0) - here.mean(0)

    def places(self) -> np.ndarray:
        """Of all vertices and centres, (p, 3)."""
        points = [self._vertex(vertex).at for vertex in self.unknowns.vertices]
        points += [self.circle(Centre(circle=name))[1].at for name in self.unknowns.circles]
        return np.array(points).reshape(-1, 3)

    def evaluated(self, quantities: tuple[Quantity, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Values (M,) and their derivatives (M, n) by the unknowns."""
        found = [MEASURANDS[each.kind].on_plane(self, each) for each in quantities]
        gradient = np.zeros((len(found), self.unknowns.count + 1))
        for m, each in enumerate(found):
            for k, slope in each.gradient.items():
                gradient[m, k] = slope
        return np.array([float(each.value) for each in found]), gradient[:, :-1]

    def _vertex(self, index: int) -> Point:
        name = self.unknowns.vertex(index)
        at = self.solid.vertices[index] + self.unknowns.full(name, self.numbers)
        return Point(self.turned @ at, _moves(self.unknowns.basis(name)))


def _moves(basis: np.ndarray) -> dict[int, np.ndarray]:
    """Derivatives (3,) by the unknowns by which there are some, of a basis (3, n)."""
    return {int(k): basis[:, k] for k in np.flatnonzero(basis.any(0))}
