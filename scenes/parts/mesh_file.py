"""A polyhedron from a mesh file."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from scenes.parts.curved import Curved
from scenes.parts.part_file import PartFile
from scenes.parts.solid import Solid
from scenes.units import Unit, in_unit

SAY_UNIT = (".glb", ".3mf")  # what they hold is in it


class Mesh(PartFile):
    """A part from a mesh file (STL, PLY, OBJ, GLB or 3MF).

    Vertices, edges, circles and faces get the names that `scenes.parts.mesh.solid` gives; ``ice show`` lists them.
    """

    kind: Literal["mesh"]
    """A mesh."""
    units: Unit | None = None
    """Of the file's numbers; where not given what the file says (GLB, 3MF), else the scene's."""
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)
    """Names of its own for vertices, by their position [length]."""

    def __hash__(self) -> int:
        return hash((self.file, self.body, self.units, tuple(sorted(self.names.items()))))

    @property
    def _said(self) -> tuple:
        return self.file, self.body, self.units, self.names

    def solid_in(self, unit: Unit | None) -> Solid:
        """Vertices, faces, edges and circles in a unit, the file's own where not given; read once."""
        if self.units is None and self.file.suffix.lower() in SAY_UNIT:
            return self._once(self._read, None, unit or "mm")
        return self._once(self._read, 1.0 if None in (unit, self.units) else in_unit(1.0, self.units, unit))

    def curved_in(self, unit: Unit | None) -> tuple[Curved, ...]:
        """Cylinders recognised among the facets that can be measured."""
        from scenes.parts.walls import recognised_walls  # loads scipy.optimize

        return recognised_walls(self.solid_in(unit))

    def _read(self, file: Path, scale: float | None, unit: Unit = "mm") -> Solid:
        from scenes.parts import mesh  # loads trimesh

        return mesh.renamed(mesh.read(file, scale, unit, self.body), self.names)
