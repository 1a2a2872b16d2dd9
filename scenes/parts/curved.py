"""A curved surface of a part by its name: exact, beside the plane facets that hide and shade for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from scenes.parts.surfaces import Cone, Cylinder, Sphere, axes_beside
from scenes.viewpoint import Viewpoint


@dataclass(frozen=True, eq=False)
class Curved:
    """A sphere, cylinder or cone of a part.

    Attributes
    ----------
    name : str
    surface : Sphere, Cylinder or Cone
        Between finite ends, its point in their middle.
    faces : tuple of int
        The facets of the solid that stand for it; their corners lie on it.
    """

    name: str
    surface: Sphere | Cylinder | Cone
    faces: tuple[int, ...]

    @property
    def centre(self) -> np.ndarray:
        """Of the sphere, or the middle of the axis, shape (3,)."""
        return self.surface.centre if isinstance(self.surface, Sphere) else self.surface.point

    @property
    def radius(self) -> float:
        """Its length; of a cone that in its middle."""
        return self.surface.radius

    @property
    def count(self) -> int:
        """How many numbers it is found by: three, of a cone four."""
        return 4 if isinstance(self.surface, Cone) else 3

    @property
    def half_angle(self) -> float:
        """Between axis and wall, rad; 0 but for a cone."""
        return math.radians(self.surface.half_angle_deg) if isinstance(self.surface, Cone) else 0.0

    def sideways(self, eye: Viewpoint | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Two directions (..., 3) across the line of sight from an eye (...), by which its place is told.

        A sphere's centre is shifted along both. A cylinder's axis, which runs to nowhere in the image, is shifted along
        the first, across the axis too; the second is 0, for the axis turns.
        """
        sight = -Viewpoint.of(eye).towards(self.centre)
        if isinstance(self.surface, Sphere):
            sight = sight / np.linalg.norm(sight, axis=-1, keepdims=True)
            helper = np.eye(3)[np.abs(sight).argmin(-1)]
            one = np.cross(sight, helper)
            one = one / np.linalg.norm(one, axis=-1, keepdims=True)
            return one, np.cross(sight, one)
        one = np.cross(sight, self.surface.axis)
        size = np.linalg.norm(one, axis=-1, keepdims=True)
        return one / np.where(size > 0, size, np.nan), np.zeros_like(one)

    def parameters(self, eye: Viewpoint | np.ndarray) -> np.ndarray:
        """The surface's own p parameters for one of those by which it is found, from one eye, (p, count).

        Both shifts of `sideways`, of a cylinder or cone the first and a turn of the axis (rad) that way; then the
        radius; of a cone then its half angle (rad). The distance from the eye is held.
        """
        found = np.zeros((len(self.surface.parameters), self.count))
        one, two = self.sideways(eye)
        found[:3, 0] = one
        if isinstance(self.surface, Sphere):
            found[:3, 1] = two
        else:
            found[3:5, 1] = [one @ beside for beside in axes_beside(self.surface.axis)]
        found[self.surface.parameters.index("radius"), 2] = 1.0
        if isinstance(self.surface, Cone):
            found[self.surface.parameters.index("half_angle"), 3] = 1.0
        return found

    def moved(self, eye: Viewpoint | np.ndarray, errors: tuple[float, ...]) -> Curved:
        """The same with errors of these."""
        one, two = self.sideways(eye)
        place = self.centre + errors[0] * one
        if isinstance(self.surface, Sphere):
            made = replace(self.surface, centre=place + errors[1] * two, radius=self.radius + errors[2])
        else:
            axis = self.surface.axis + math.tan(errors[1]) * one
            made = _turned(self.surface, place, axis, self.radius + errors[2], *errors[3:])
        return replace(self, surface=made)


def _turned(surface: Cylinder | Cone, point: np.ndarray, axis: np.ndarray, radius: float, more: float = 0.0):
    """A cylinder or cone elsewhere, a cone's half angle ``more`` (rad) larger; it ends where its radius would."""
    if isinstance(surface, Cylinder):
        return replace(surface, point=point, axis=axis, radius=radius)
    angle = surface.half_angle_deg + math.degrees(more)
    slope, (low, high) = math.tan(math.radians(angle)), surface.ends
    if slope > 0:
        low = max(low, -radius / slope)
    elif slope < 0:
        high = min(high, -radius / slope)
    return replace(surface, point=point, axis=axis, radius=radius, half_angle_deg=angle, ends=(low, high))
