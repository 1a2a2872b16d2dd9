"""A polyhedron from a mesh file."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from scenes.model import Model
from scenes.parts import mesh
from scenes.parts.solid import Solid


class Mesh(Model):
    """A polyhedron from a mesh file (STL, PLY or OBJ, lengths in cm).

    ``file`` is relative to the scene's file. Vertices, edges and circles get the names that `scenes.mesh.solid` gives;
    ``names`` may give vertices (by their position, cm) other ones.
    """

    kind: Literal["mesh"]
    file: Path
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)

    def __hash__(self) -> int:
        return hash((self.file, tuple(sorted(self.names.items()))))

    @field_validator("file")
    @classmethod
    def _beside_the_scene(cls, file: Path, info: ValidationInfo) -> Path:
        return (info.context or {}).get("directory", Path()) / file

    @property
    def solid(self) -> Solid:
        """Vertices, faces, edges and circles of the mesh."""
        try:
            stamp = self.file.stat().st_mtime_ns
        except OSError:
            stamp = 0
        return _read(self.file, tuple(self.names.items()), stamp)


@lru_cache(maxsize=16)
def _read(file: Path, names: tuple, _stamp: int) -> Solid:
    return mesh.renamed(mesh.read(file), dict(names))
