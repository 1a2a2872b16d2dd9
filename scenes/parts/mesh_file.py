"""A polyhedron from a mesh file."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, field_validator

from scenes.model import Model
from scenes.parts.solid import Solid
from scenes.units import Unit, in_unit


class Mesh(Model):
    """A part from a mesh file (STL, PLY or OBJ).

    Vertices, edges, circles and faces get the names that `scenes.parts.mesh.solid` gives; ``ice show`` lists them.
    """

    kind: Literal["mesh"]
    """A mesh."""
    file: Path
    """Relative to the scene's file."""
    units: Unit | None = None
    """Of the file's numbers; the scene's where not given."""
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)
    """Names of its own for vertices, by their position [length]."""

    _made: _Made | None = PrivateAttr(None)  # what the file held when it was read

    def __hash__(self) -> int:
        return hash((self.file, self.units, tuple(sorted(self.names.items()))))

    def __eq__(self, other: object) -> bool:
        """A file that has changed is another mesh, so that nothing that was kept of the old one is taken for it."""
        same = isinstance(other, Mesh) and self._said == other._said
        return same and np.array_equal(self.solid.triangles, other.solid.triangles)

    @field_validator("file")
    @classmethod
    def _beside_the_scene(cls, file: Path, info: ValidationInfo) -> Path:
        return (info.context or {}).get("directory", Path()) / file

    @property
    def _said(self) -> tuple:
        return self.file, self.units, self.names

    @property
    def solid(self) -> Solid:
        """Vertices, faces, edges and circles of the mesh, in its own unit."""
        return self.solid_in(None)

    def solid_in(self, unit: Unit | None) -> Solid:
        """The same in another unit; read once."""
        scale = 1.0 if None in (unit, self.units) else in_unit(1.0, self.units, unit)
        made = self._made
        if made is None or not (made.file is self.file and made.names is self.names and made.scale == scale):
            from scenes.parts import mesh  # loads trimesh

            made = _Made(self.file, self.names, scale, mesh.renamed(mesh.read(self.file, scale), self.names))
            self._made = made
        return made.solid


class _Made(NamedTuple):
    """A solid, and what it was read from."""

    file: Path
    names: dict[str, tuple[float, float, float]]
    scale: float
    solid: Solid
