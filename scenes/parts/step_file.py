"""A part from a STEP file, as a scene says it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from scenes.parts.curved import Curved
from scenes.parts.part_file import PartFile
from scenes.parts.solid import Solid
from scenes.units import Unit

if TYPE_CHECKING:
    from scenes.parts.step import StepPart


class Step(PartFile):
    """A part from a STEP file, through OpenCASCADE (`pip install 'ice-vision[step]'`).

    The file says its unit. Plane faces that it names keep their names; vertices, edges, circles and other faces get
    those that `scenes.parts.mesh.solid` gives; ``ice show`` lists them.
    """

    kind: Literal["step"]
    """A STEP file."""

    def solid_in(self, unit: Unit | None) -> Solid:
        """Vertices, faces, edges and circles in a unit, mm where not given; read once."""
        return self.part_in(unit).solid

    def curved_in(self, unit: Unit | None) -> tuple[Curved, ...]:
        """Curved surfaces that can be measured, as exact as the file."""
        return self.part_in(unit).curved

    def part_in(self, unit: Unit | None) -> StepPart:
        """Exact surfaces and edges in a unit, mm where not given; read once."""
        from scenes.parts import step  # loads trimesh

        return self._once(step.read, unit or "mm", self.body)
