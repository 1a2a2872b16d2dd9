"""A material of a user's own: Lambertian, with a lobe about the mirrored light (Phong's, normalised)."""

from typing import Annotated, Literal

from pydantic import Field

from scenes.materials import MATERIALS, Brdf
from scenes.materials.vectors import dot
from scenes.ranges import Fraction


@MATERIALS.add("satin")
class Satin(Brdf):
    """A matt surface under a blurred mirror."""

    kind: Literal["satin"]
    """satin"""
    reflectance: Fraction = 0.6
    """Of the Lambertian part."""
    mirrored: Fraction = 0.2
    """Part of the light that the mirror sends on."""
    exponent: Annotated[float, Field(ge=1, le=1e4)] = 40.0
    """Of the cosine of the angle from the mirrored light."""

    @property
    def lambertian(self) -> float:
        return self.reflectance

    @property
    def dull(self) -> str | None:
        return "mirrored is 0" if self.mirrored == 0 else None

    @property
    def lobe_reflectance(self) -> float:
        return self.mirrored

    @property
    def lobe_slope(self) -> float:
        return 0.5 / self.exponent**0.5

    def lobe(self, index, normal, to_light, to_sensor, polarisation, analyser, ops):
        nl, nv = dot(normal, to_light), dot(normal, to_sensor)
        cosine = ops.maximum(2 * nl * nv - dot(to_light, to_sensor), ops.tiny)
        passed = 0.5 if analyser is not None else 1.0
        return passed * self.mirrored * (self.exponent + 2) / 2 * ops.exp(self.exponent * ops.log(cosine)) * nl

    def matt(self) -> "Satin":
        return self.tried(mirrored=0.0)

    def dimmed(self, part: float) -> "Satin":
        return self.tried(reflectance=(1 - part) * self.reflectance, mirrored=(1 - part) * self.mirrored)
