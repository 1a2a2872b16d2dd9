"""A curved surface of a part by its name: exact, beside the plane facets that hide and shade for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from scenes.parts.surfaces import Cone, Cylinder, Sphere, axes_beside


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

    def sideways(self, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Two directions (..., 3) across the line of sight from an eye (..., 3), by which its place is told.

        A sphere's centre is shifted along both. A cylinder's axis, which runs to nowhere in the image, is shifted along
        the first, across the axis too; the second is 0, for the axis turns.
        """
        sight = self.centre - eye
        if isinstance(self.surface, Sphere):
            sight = sight / np.linalg.norm(sight, axis=-1, keepdims=True)
            helper = np.eye(3)[np.abs(sight).argmin(-1)]
            one = np.cross(sight, helper)
            one = one / np.linalg.norm(one, axis=-1, keepdims=True)
            return one, np.cross(sight, one)
        one = np.cross(sight, self.surface.axis)
        size = np.linalg.norm(one, axis=-1, keepdims=True)
        return one / np.where(size > 0, size, np.nan), np.zeros_like(one)

    def parameters(self, eye: np.ndarray) -> np.ndarray:
        """The surface's own p parameters for one of the three by which it is found, from an eye (3,), shape (p, 3).

        Both shifts of `sideways`, of a cylinder or cone the first and a turn of the axis (rad) that way; then the
        radius. The distance from the eye is held, and the taper.
        """
        found = np.zeros((len(self.surface.parameters), 3))
        one, two = self.sideways(eye)
        found[:3, 0] = one
        if isinstance(self.surface, Sphere):
            found[:3, 1] = two
        else:
            found[3:5, 1] = [one @ beside for beside in axes_beside(self.surface.axis)]
        found[self.surface.parameters.index("radius"), 2] = 1.0
        return found

    def moved(self, eye: np.ndarray, errors: tuple[float, ...]) -> Curved:
        """The same with errors of the three."""
        one, two = self.sideways(eye)
        place = self.centre + errors[0] * one
        if isinstance(self.surface, Sphere):
            made = replace(self.surface, centre=place + errors[1] * two, radius=self.radius + errors[2])
        else:
            axis = self.surface.axis + math.tan(errors[1]) * one
            made = replace(self.surface, point=place, axis=axis, radius=self.radius + errors[2])
        return replace(self, surface=made)
