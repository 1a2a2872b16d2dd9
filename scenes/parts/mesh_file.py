"""A polyhedron from a mesh file."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, field_validator

from scenes.model import Model
from scenes.parts.solid import Solid


class Mesh(Model):
    """A polyhedron from a mesh file (STL, PLY or OBJ, lengths in cm).

    ``file`` is relative to the scene's file. Vertices, edges and circles get the names that `scenes.mesh.solid` gives;
    ``names`` may give vertices (by their position, cm) other ones.
    """

    kind: Literal["mesh"]
    file: Path
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)

    _made: tuple[tuple, Solid] | None = PrivateAttr(None)  # what the file held when it was read

    def __hash__(self) -> int:
        return hash((self.file, tuple(sorted(self.names.items()))))

    def __eq__(self, other: object) -> bool:
        """A file that has changed is another mesh, so that nothing that was kept of the old one is taken for it."""
        same = isinstance(other, Mesh) and (self.file, self.names) == (other.file, other.names)
        return same and np.array_equal(self.solid.triangles, other.solid.triangles)

    @field_validator("file")
    @classmethod
    def _beside_the_scene(cls, file: Path, info: ValidationInfo) -> Path:
        return (info.context or {}).get("directory", Path()) / file

    @property
    def solid(self) -> Solid:
        """Vertices, faces, edges and circles of the mesh, read once."""
        from scenes.parts import mesh  # loads trimesh

        key = self.file, tuple(self.names.items())
        if self._made is None or self._made[0] != key:
            self._made = key, mesh.renamed(mesh.read(self.file), self.names)
        return self._made[1]
