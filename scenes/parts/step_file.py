"""A part from a STEP file, as a scene says it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from pydantic import PrivateAttr, ValidationInfo, field_validator

from scenes.model import Model
from scenes.parts.solid import Solid
from scenes.units import Unit

if TYPE_CHECKING:
    from scenes.parts.step import StepPart


class Step(Model):
    """A part from a STEP file, through OpenCASCADE (`pip install 'ice-vision[step]'`).

    The file says its unit. Plane faces that it names keep their names; vertices, edges, circles and other faces get
    those that `scenes.parts.mesh.solid` gives; ``ice show`` lists them.
    """

    kind: Literal["step"]
    """A STEP file."""
    file: Path
    """Relative to the scene's file."""

    _made: _Made | None = PrivateAttr(None)  # what the file held when it was read

    def __hash__(self) -> int:
        return hash(self.file)

    def __eq__(self, other: object) -> bool:
        """A file that has changed is another part."""
        same = isinstance(other, Step) and self.file == other.file
        return same and np.array_equal(self.solid.triangles, other.solid.triangles)

    @field_validator("file")
    @classmethod
    def _beside_the_scene(cls, file: Path, info: ValidationInfo) -> Path:
        return (info.context or {}).get("directory", Path()) / file

    @property
    def solid(self) -> Solid:
        """Vertices, faces, edges and circles, mm."""
        return self.solid_in(None)

    def solid_in(self, unit: Unit | None) -> Solid:
        """The same in another unit; read once."""
        return self.part_in(unit).solid

    def part_in(self, unit: Unit | None) -> StepPart:
        """Exact surfaces and edges in a unit, mm where not given; read once."""
        made, wanted = self._made, unit or "mm"
        if made is None or not (made.file is self.file and made.unit == wanted):
            from scenes.parts import step  # loads trimesh

            made = _Made(self.file, wanted, step.read(self.file, wanted))
            self._made = made
        return made.part


class _Made(NamedTuple):
    """A part, and what it was read from."""

    file: Path
    unit: Unit
    part: StepPart
