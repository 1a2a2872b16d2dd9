"""Light on a plane face beside a rim that is measured: told in rings about it.

A rim is small beside the cells in which its face is told, and its contrast needs the light within a few pixels of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenes import Circle, Scene, Solid
from scenes.materials.vectors import length

_AROUND, _DENSEST = 32, 4.0  # nodes of a ring at least, and nodes a cell where the rim is larger
_RINGS = np.array([0.0, 0.2, 1.0])  # of the width
_WIDE = 0.5  # of the radius, and a cell at most
_FULL = 0.5  # of the width: so far the rings alone tell the light, beyond the face's own nodes do more and more
_NEAR = 1.0  # of the radius: places of patches are densest so near to a rim
_WITHIN = 0.01  # of the width


@dataclass(frozen=True, eq=False)
class Annulus:
    """The part of a plane face beside a rim.

    Attributes
    ----------
    circle : Circle
        The rim.
    width : float
        Scene units.
    count : int
        Nodes of a ring.
    outwards : int
        1 where the face lies about the rim, as at a hole's mouth and a pin's foot; -1 where it lies within it, as at a
        hole's ground and a pin's top.
    """

    circle: Circle
    width: float
    count: int
    outwards: int

    @classmethod
    def beside(cls, solid: Solid, circle: Circle, cell: float) -> Annulus:
        """As wide and as dense as a rim needs on a face that is told in cells of some side."""
        outwards = 1 if circle.hole == solid.edge(circle.edges[0]).convex else -1
        count = nodes_around(circle.turn, circle.radius, cell)
        return cls(circle, min(_WIDE * circle.radius, cell), count, outwards)

    @property
    def closed(self) -> bool:
        """Whether its rings are whole."""
        return self.circle.ends is None

    @property
    def size(self) -> np.ndarray:
        """Of the coordinates, (2,)."""
        return np.array([self.count, self.width])

    @property
    def rings(self) -> np.ndarray:
        """How far they are from the rim."""
        return self.width * _RINGS

    def nodes(self) -> np.ndarray:
        """Around the rim, then from ring to ring, (n, 3); none is on the rim, where light comes from both sides."""
        spokes = self.circle.spokes(self.circle.angles(self.count))
        away = self.outwards * np.maximum(self.rings, _WITHIN * self.width)
        return self.circle.centre + ((self.circle.radius + away)[:, None] * spokes[:, None]).reshape(-1, 3)

    def coordinates(self, points: np.ndarray) -> np.ndarray:
        """Of points (n, 3) of the face: steps around the rim and distance from it, (n, 2); elsewhere those of the
        nearest place."""
        steps = self.circle.steps(self._angle(points), self.count)
        return np.stack([steps, np.clip(self._away(points), 0, self.width)], -1)

    def share(self, points: np.ndarray) -> np.ndarray:
        """How much the rings tell of the light at points (n, 3) of the face: 1 beside the rim, 0 away from it."""
        found = np.clip((self.width - self._away(points)) / ((1 - _FULL) * self.width), 0, 1)
        if self.closed:
            return found
        turned = (self._angle(points) - self.circle.begin - self.circle.turn / 2 + np.pi) % (2 * np.pi) - np.pi
        beyond = (np.abs(turned) / self.circle.turn - 0.5) * self.count  # steps beyond its ends
        return found * np.clip(1 - beyond, 0, 1)

    def _angle(self, points: np.ndarray) -> np.ndarray:
        one, two = self.circle.axes
        return np.arctan2((points - self.circle.centre) @ two, (points - self.circle.centre) @ one)

    def _away(self, points: np.ndarray) -> np.ndarray:
        """Distance of points (n, 3) from the rim, positive on the face."""
        return self.outwards * (length(points - self.circle.centre) - self.circle.radius)


def nodes_around(turn: float, radius: float, cell: float) -> int:
    """How many tell what is so round, of some turn in rad, where light is told in cells of some side."""
    return max(4, int(np.ceil(max(_AROUND * turn / (2 * np.pi), _DENSEST * turn * radius / cell))))


def measured_rims(scene: Scene) -> tuple[Circle, ...]:
    """Rims that a scene's numbers need."""
    return tuple(circle for circle in scene.solid.rims if circle.name in scene.required)


def about(rims: tuple[Circle, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Places (k, 3) of rims, and what is near to each of them (k,)."""
    places = np.concatenate([circle.around(_AROUND) for circle in rims])
    return places, np.repeat([_NEAR * circle.radius for circle in rims], _AROUND)
