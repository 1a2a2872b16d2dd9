"""A rectangular block."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

from scenes.model import Model
from scenes.parts.solid import Solid, block
from scenes.ranges import Length
from scenes.units import Unit


class Block(Model):
    """A rectangular block with a corner at the origin and its sides along the axes."""

    kind: Literal["block"] = "block"
    """A block."""
    size: tuple[Length, Length, Length]
    """Along x, y and z [length]."""

    @property
    def solid(self) -> Solid:
        """Vertices, faces and edges, named as in the paper's Fig. 6."""
        return _made(self.size)

    def solid_in(self, unit: Unit | None) -> Solid:
        """The same: its numbers are of the scene's unit, whichever that is."""
        return self.solid


_made = lru_cache(maxsize=64)(block)  # of the size, not of the record: copies of a record share its caches
