"""A point of light, or a sphere."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from scenes.lights.kinds import LIGHTS
from scenes.lights.luminaire import FULL, Luminaire, Nodes, needed, shining

POINT = 7e-3  # half size over distance of a sphere that is taken for a point: its shading is off by 2 of its square
_SMALL = 1e-2  # of the distance: in single precision Mitsuba samples a smaller sphere wrongly, but not a disc
_SHELLS = 3  # of a sphere


@LIGHTS.add("point")
class Light(Luminaire):
    """A point, or a sphere that shines alike from everywhere."""

    kind: Literal["point"] = "point"
    """point"""
    radius: Annotated[float, Field(ge=0)] = 0.0
    """0 for a point [length]."""

    @model_validator(mode="after")
    def _clear(self) -> Light:
        if self.radius >= self.distance / 2:
            raise ValueError(f"light.radius must be less than half of light.distance, got {self.radius:g}")
        return self

    @property
    def half_size(self) -> float:
        """Its radius [length]."""
        return self.radius

    @property
    def is_point(self) -> bool:
        """Whether it is one, or so small a sphere that it is taken for one."""
        return self.radius <= POINT * self.distance

    def nodes(self, reach: float, fewest: int = FULL) -> Nodes:
        """Gauss-Chebyshev shells of density 1 / sqrt(1 - r^2), whose projection is a disc, with Gauss nodes on each.

        The shells are turned against each other, so that a horizon meets their nodes one by one.
        """
        power = self.intensity * self.distance**2
        if self.is_point:
            return Nodes(np.zeros((1, 3)), None, np.array([power]))
        count = self.count(reach, fewest)
        shells = np.sin((np.arange(_SHELLS) + 0.5) * np.pi / (2 * _SHELLS))[:, None, None]
        cosine, weight = np.polynomial.legendre.leggauss(count)
        angle = (np.arange(2 * count) + np.arange(1, _SHELLS + 1)[:, None, None] / (_SHELLS + 1)) * np.pi / count
        sine = np.sqrt(1 - cosine**2)[:, None]
        ways = np.stack(np.broadcast_arrays(sine * np.cos(angle), cosine[:, None], sine * np.sin(angle)), -1)
        powers = np.broadcast_to(shells**2 / (shells**2).sum() * weight[:, None] / (4 * count), ways.shape[:-1])
        return Nodes((self.radius * shells[..., None] * ways).reshape(-1, 3), None, power * powers.ravel())

    def described(self, axes: np.ndarray, exposure: float, reach: float) -> list[dict[str, Any]]:
        """A point, or a sphere; a disc where that is so small that Mitsuba's single precision would fail."""
        at, strength = axes[:3, 3].tolist(), exposure * self.intensity * self.distance**2
        if self.radius == 0:
            return [{"type": "point", "position": at, "intensity": {"type": "spectrum", "value": strength}}]
        radiance = strength / (math.pi * self.radius**2)
        if self.radius < _SMALL * self.distance:
            disc = {"type": "disk", "to_world": np.diag([self.radius, self.radius, self.radius, 1.0])}
            return [shining(disc, axes, radiance)]
        ball = shining({"type": "sphere", "center": at, "radius": self.radius}, axes, radiance)
        del ball["to_world"]  # its place is said
        return [ball]

    def _needed(self, distance: float) -> int:
        return needed(self.half_size / distance)  # its field is told by powers of its radius over distance


def as_point(light: Luminaire) -> Luminaire:
    """A point in its middle that gives the same irradiance at the reference point; itself where it has no size."""
    if light.half_size == 0:
        return light
    return Light(**{name: getattr(light, name) for name in Luminaire.model_fields if name != "kind"})
