"""The kinds of light by name."""

from __future__ import annotations

from typing import Annotated

from scenes.lights.luminaire import Luminaire
from scenes.registry import OneOf, Registry

LIGHTS: Registry[type[Luminaire]] = Registry("light.kind")
AnyLight = Annotated[Luminaire, OneOf(LIGHTS, "point")]
