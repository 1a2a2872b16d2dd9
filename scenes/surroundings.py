"""What light meets besides the object, and how exactly poses are set."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from scenes.model import Model
from scenes.parts.solid import Solid, block
from scenes.ranges import Fraction, Length, NotNegative, Positive


class Floor(Model):
    """A diffuse square plane below the object."""

    reflectance: Fraction
    """Part of the light that it sends back."""
    height: float = 0.0
    """Not above the object's lowest point [length]."""
    half_side: Positive = 1000.0
    """How far it reaches each way [length]."""


class Obstacle(Model):
    """A block beside the measured object, of the same material."""

    corner: tuple[float, float, float]
    """Its corner of least x, y and z [length]."""
    size: tuple[Length, Length, Length]
    """Along x, y and z [length]."""

    @property
    def solid(self) -> Solid:
        """Its geometry, where it stands."""
        return _standing(self.corner, self.size)


@lru_cache(maxsize=64)  # of the numbers, not in the record: a changed copy would keep the old geometry
def _standing(corner: tuple[float, float, float], size: tuple[float, float, float]) -> Solid:
    here = block(size)
    return Solid(here.vertex_names, here.vertices + np.array(corner), here.faces, here.edges)


class Jitter(Model):
    """Standard deviations with which poses are set, along each of the sphere's two directions."""

    sensor_deg: NotNegative = 0.0
    """Of the sensor [degrees]."""
    light_deg: NotNegative = 0.0
    """Of the light [degrees]."""
