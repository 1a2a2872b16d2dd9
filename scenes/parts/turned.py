"""A turned part: cylinders, cones and plane shoulders about one axis."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from scenes.model import Model
from scenes.parts.curved import Curved
from scenes.parts.solid import Solid
from scenes.parts.surfaces import Cone, Cylinder
from scenes.ranges import Coordinate, Length
from scenes.units import Unit

_SEGMENTS = 48  # pieces of a full turn
_LARGE = 20  # the power of two that a part is made as large as: nothing is rounded
_SAME = 1e-9  # of the largest number


class Turned(Model):
    """A part turned about an axis through the origin; plane at both ends.

    Its walls are called ``d1``, ``d2``, ... in the order of the profile: a cylinder between two equal radii, a cone
    between two others; between two equal places along the axis there is a shoulder.
    """

    kind: Literal["turned"]
    """A turned part."""
    axis: Literal["x", "y", "z"] = "z"
    """Which axis it is turned about."""
    profile: Annotated[tuple[tuple[Coordinate, Length], ...], Field(min_length=2, max_length=40)]
    """Places along the axis, never falling, and radii there [length]."""

    @field_validator("profile")
    @classmethod
    def _rising(cls, profile: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        places = [place for place, _ in profile]
        steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(profile)]
        if any(along < 0 or (along == 0 and across == 0) for along, across in steps):
            raise ValueError(f"profile must be different points along the axis, never falling, got {places}")
        if steps[0][0] == 0 or steps[-1][0] == 0:
            raise ValueError("profile must begin and end with a wall, got a shoulder")
        if any(a[0] == 0 and b[0] == 0 for a, b in pairwise(steps)):
            raise ValueError("profile must have one shoulder at a place, got two")
        return profile

    @property
    def solid(self) -> Solid:
        """Facets whose corners lie on the walls, circles around shoulders and ends, and the walls themselves."""
        return _made(self.axis, self.profile)

    def solid_in(self, unit: Unit | None) -> Solid:
        """The same: its numbers are of the scene's unit, whichever that is."""
        return self.solid


@lru_cache(maxsize=64)
def _made(axis: str, profile: tuple[tuple[float, float], ...]) -> Solid:
    import trimesh  # half a second to load

    from scenes.parts import mesh

    line = np.array([(0.0, profile[0][0]), *((r, z) for z, r in profile), (0.0, profile[-1][0])])
    larger = 2.0 ** (_LARGE - math.frexp(np.abs(line).max())[1])  # what is small in any unit is left out by its library
    made = trimesh.creation.revolve(larger * line, sections=_SEGMENTS)
    made = trimesh.Trimesh(made.vertices @ _frame(axis) / larger, made.faces)
    solid = mesh.solid(made)
    walls = [(a, b) for a, b in pairwise(profile) if b[0] > a[0]]
    return replace(
        solid, curved=tuple(_wall(solid, _frame(axis)[2], f"d{i}", *ends) for i, ends in enumerate(walls, 1))
    )


def _frame(axis: str) -> np.ndarray:
    """Rows: where x, y and z of the profile's own frame go; its z becomes the axis."""
    k = "xyz".index(axis)
    return np.eye(3)[[(k + 1) % 3, (k + 2) % 3, k]]


def _wall(solid: Solid, axis: np.ndarray, name: str, low: tuple[float, float], high: tuple[float, float]) -> Curved:
    middle, half = (low[0] + high[0]) / 2, (high[0] - low[0]) / 2
    radius, slope = (low[1] + high[1]) / 2, (high[1] - low[1]) / (high[0] - low[0])
    if low[1] == high[1]:
        surface = Cylinder(middle * axis, axis, radius, (-half, half))
    else:
        surface = Cone(middle * axis, axis, radius, (-half, half), half_angle_deg=math.degrees(math.atan(slope)))
    return Curved(name, surface, _facets(solid, axis, low, high))


def _facets(solid: Solid, axis: np.ndarray, low: tuple[float, float], high: tuple[float, float]) -> tuple[int, ...]:
    """Faces with corners at both ends of a wall and nowhere else."""
    height = solid.vertices @ axis
    far = np.linalg.norm(solid.vertices - height[:, None] * axis, axis=1)
    near = _SAME * np.abs(solid.vertices).max()
    at = [(np.abs(height - z) <= near) & (np.abs(far - r) <= near) for z, r in (low, high)]
    loops = [list(face) for face in solid.faces]
    return tuple(
        f for f, face in enumerate(loops) if (at[0] | at[1])[face].all() and at[0][face].any() and at[1][face].any()
    )
