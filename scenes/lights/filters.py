"""Lamps and filters at hand: the list from which a plan chooses a band of wavelengths."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator, model_validator

from scenes.model import Model
from scenes.ranges import Curve, rising

Name = Annotated[str, Field(min_length=1, max_length=100)]
_Given = Annotated[Curve, Field(min_length=1)]


class Lamp(Model):
    """A lamp that may take the place of the scene's own."""

    name: Name
    """What the plan calls it."""
    spectrum: _Given
    """Q of eq. 1: rows [nm, relative value]."""
    power: Annotated[float, Field(ge=1e-6, le=1e6)] = 1.0
    """Grey levels that it adds to a white diffuse surface in the same time, over those of the scene's own lamp."""

    @field_validator("spectrum")
    @classmethod
    def _in_order(cls, rows: tuple) -> tuple:
        return rising("lamps.spectrum", rows)

    @model_validator(mode="after")
    def _shines(self) -> Lamp:
        if not any(value > 0 for _, value in self.spectrum):
            raise ValueError(f"lamps.spectrum must have a value above 0, got none for {self.name!r}")
        return self


class Filter(Model):
    """A filter that may be put before the lens."""

    name: Name
    """What the plan calls it."""
    transmission: _Given
    """Rows [nm, part of the light that passes]; at the ends constant beyond."""

    @field_validator("transmission")
    @classmethod
    def _in_order(cls, rows: tuple) -> tuple:
        if any(value > 1 for _, value in rows):
            raise ValueError(f"filters.transmission must be at most 1, got {max(value for _, value in rows):g}")
        return rising("filters.transmission", rows)


def check_names(key: str, items: tuple[Lamp | Filter, ...]) -> None:
    """See that no two lamps, or no two filters, have one name."""
    names = [item.name for item in items]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{key} must have different names, got {name!r} twice")
