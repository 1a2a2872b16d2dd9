"""A polyhedron from a mesh file."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from scenes.parts.curved import Curved
from scenes.parts.part_file import PartFile
from scenes.parts.solid import Solid
from scenes.units import Unit, in_unit


class Mesh(PartFile):
    """A part from a mesh file (STL, PLY or OBJ).

    Vertices, edges, circles and faces get the names that `scenes.parts.mesh.solid` gives; ``ice show`` lists them.
    """

    kind: Literal["mesh"]
    """A mesh."""
    units: Unit | None = None
    """Of the file's numbers; the scene's where not given."""
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)
    """Names of its own for vertices, by their position [length]."""

    def __hash__(self) -> int:
        return hash((self.file, self.units, tuple(sorted(self.names.items()))))

    @property
    def _said(self) -> tuple:
        return self.file, self.units, self.names

    def solid_in(self, unit: Unit | None) -> Solid:
        """Vertices, faces, edges and circles in a unit, the file's own where not given; read once."""
        return self._once(self._read, 1.0 if None in (unit, self.units) else in_unit(1.0, self.units, unit))

    def curved_in(self, unit: Unit | None) -> tuple[Curved, ...]:
        """Cylinders recognised among the facets that can be measured."""
        from scenes.parts.walls import recognised_walls  # loads scipy.optimize

        return recognised_walls(self.solid_in(unit))

    def _read(self, file: Path, scale: float) -> Solid:
        from scenes.parts import mesh  # loads trimesh

        return mesh.renamed(mesh.read(file, scale), self.names)
