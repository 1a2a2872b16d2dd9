"""What surfaces are made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator

from scenes.model import Model
from scenes.ranges import Fraction, Positive, rising


class Material(Model):
    """Reflectance of the surface: the paper's Torrance-Sparrow model (its section 2).

    ``specular_fraction`` is s, ``diffuse_reflectance`` R_d, ``refractive_index`` n, ``extinction`` k
    and ``roughness`` the Beckmann m. With n = 1 and k = 0 the Fresnel term vanishes and the surface is
    purely diffuse, reflecting (1 - s) R_d. ``index_table`` gives n and k by wavelength, rows
    [wavelength in nm, n, k] with rising wavelengths, and then replaces ``refractive_index`` and ``extinction``.
    """

    specular_fraction: Fraction = 0.0
    diffuse_reflectance: Fraction = 1.0
    refractive_index: Annotated[float, Field(gt=0, le=1e6)] = 1.0  # its square and its square's square must be numbers
    extinction: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    roughness: Annotated[float, Field(ge=1e-6, le=1e6)] = 0.2
    index_table: tuple[tuple[Positive, Positive, Annotated[float, Field(ge=0, le=1e6)]], ...] = ()

    @field_validator("index_table")
    @classmethod
    def _in_order(cls, rows: tuple) -> tuple:
        return rising("material.index_table", rows)

    @property
    def is_diffuse(self) -> bool:
        """Whether the specular term is exactly zero."""
        indices = [row[1:] for row in self.index_table] or [(self.refractive_index, self.extinction)]
        return self.specular_fraction == 0 or all(index == (1, 0) for index in indices)
