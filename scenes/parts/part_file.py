"""A part from a file beside the scene: found, read once, and another part when the file has changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, field_validator

from scenes.model import Model
from scenes.parts.curved import Curved
from scenes.parts.solid import Solid
from scenes.units import Unit


class PartFile(Model):
    """What parts from files have in common; a subclass says how its file is read in a unit (`solid_in`)."""

    kind: str
    file: Path
    """Relative to the scene's file."""
    body: Annotated[int, Field(ge=1)] | str | None = None
    """Name or number, from 1, of one of several bodies (STEP, GLB, 3MF); all of them where not given."""

    _made: _Made | None = PrivateAttr(None)  # what the file held when it was read

    def __hash__(self) -> int:
        return hash(self._said)

    def __eq__(self, other: object) -> bool:
        """A file that has changed is another part, so that nothing that was kept of the old one is taken for it."""
        same = isinstance(other, type(self)) and self._said == other._said
        return same and np.array_equal(self.solid.triangles, other.solid.triangles)

    @field_validator("file")
    @classmethod
    def _beside_the_scene(cls, file: Path, info: ValidationInfo) -> Path:
        return (info.context or {}).get("directory", Path()) / file

    @property
    def _said(self) -> tuple:
        """What the scene says of the part, to be compared."""
        return self.file, self.body

    @property
    def solid(self) -> Solid:
        """Vertices, faces, edges and circles, in the file's unit; mm of one that says its own."""
        return self.solid_in(None)

    def solid_in(self, unit: Unit | None) -> Solid:
        """The same in another unit; read once."""
        raise NotImplementedError

    def curved_in(self, unit: Unit | None) -> tuple[Curved, ...]:
        """Curved surfaces that the scene may measure; facets stand for those that it does not."""
        raise NotImplementedError

    def _once(self, read: Callable[..., Any], *how: object) -> Any:
        """What ``read(file, *how)`` gives; read again only of a copy of the record that says something else."""
        made, asked = self._made, (self._said, how)
        if made is None or made.asked != asked:
            made = _Made(asked, read(self.file, *how))
            self._made = made
        return made.part


@lru_cache(maxsize=64)
def with_walls(solid: Solid, walls: tuple[Curved, ...], names: tuple[str, ...] | None = None) -> Solid:
    """The solid with curved surfaces, all or those of some names; facets stand for the others as before."""
    return replace(solid, curved=tuple(wall for wall in walls if names is None or wall.name in names))


class _Made(NamedTuple):
    """What was read, and as what it was asked for."""

    asked: tuple
    part: Any
