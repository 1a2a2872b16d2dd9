"""What surfaces are made of."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from scenes.model import Model, Name
from scenes.ranges import Fraction, Positive, rising
from scenes.selection import OnFaces

_UNPRICED = {
    "measured": "a table of measured reflectance has no formula that planner and renderer could share",
    "principled": "its lobe is another one than the paper's, which planner and renderer share",
}


class Material(Model):
    """Reflectance of the surface: the paper's Torrance-Sparrow model (its section 2).

    With n = 1 and k = 0 the Fresnel term vanishes and the surface is purely diffuse, reflecting (1 - s) R_d.
    """

    kind: Literal["torrance_sparrow"] = "torrance_sparrow"
    """The paper's reflectance; others of the renderer are refused, for no formula here says how bright they are."""
    specular_fraction: Fraction = 0.0
    """s: the part of light that is reflected by facets."""
    diffuse_reflectance: Fraction = 1.0
    """R_d."""
    refractive_index: Annotated[float, Field(gt=0, le=1e6)] = 1.0  # its square and its square's square must be numbers
    """n."""
    extinction: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    """k."""
    roughness: Annotated[float, Field(ge=1e-6, le=1e6)] = 0.2
    """m of Beckmann's distribution: rms slope of the facets."""
    index_table: tuple[tuple[Positive, Positive, Annotated[float, Field(ge=0, le=1e6)]], ...] = ()
    """n and k by wavelength, instead of the two: rows [nm, n, k] of rising wavelengths."""

    @field_validator("kind", mode="before")
    @classmethod
    def _priced(cls, kind: Any) -> Any:
        """What could be rendered but not predicted is refused, with the reason."""
        if kind in _UNPRICED:
            raise ValueError(f"kind must be 'torrance_sparrow', got {kind!r}: {_UNPRICED[kind]}")
        return kind

    @field_validator("index_table")
    @classmethod
    def _in_order(cls, rows: tuple) -> tuple:
        return rising("material.index_table", rows)

    @property
    def is_diffuse(self) -> bool:
        """Whether the specular term is exactly zero."""
        indices = [row[1:] for row in self.index_table] or [(self.refractive_index, self.extinction)]
        return self.specular_fraction == 0 or all(index == (1, 0) for index in indices)


class FaceMaterial(Material, OnFaces):
    """What some faces of the object are made of, instead of `material`."""

    name: Name
    """For messages and tables."""

    @property
    def material(self) -> Material:
        """The material itself."""
        return Material(**{key: getattr(self, key) for key in Material.model_fields})
