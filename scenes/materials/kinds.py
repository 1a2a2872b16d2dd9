"""The kinds of material by name."""

from __future__ import annotations

from typing import Annotated

from scenes.materials.brdf import Brdf
from scenes.registry import OneOf, Registry

MATERIALS: Registry[type[Brdf]] = Registry("material.kind")
AnyMaterial = Annotated[Brdf, OneOf(MATERIALS, "torrance_sparrow")]
