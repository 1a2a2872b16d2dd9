"""A ball."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np

from scenes.model import Model
from scenes.parts.curved import Curved
from scenes.parts.solid import Edge, Solid
from scenes.parts.surfaces import Sphere
from scenes.ranges import Coordinate, Length
from scenes.units import Unit

_DIVIDED = 3  # times that an icosahedron's edges are halved: 1280 facets


class Ball(Model):
    """A ball; its surface is called ``ball``."""

    kind: Literal["ball"]
    """A ball."""
    radius: Length
    """Its radius [length]."""
    centre: tuple[Coordinate, Coordinate, Coordinate] | None = None
    """Its centre; standing on z = 0 over the origin if left out [length]."""

    @property
    def solid(self) -> Solid:
        """Facets whose corners lie on the sphere, and the sphere itself."""
        return _made(self.radius, self.centre or (0.0, 0.0, self.radius))

    def solid_in(self, unit: Unit | None) -> Solid:
        """The same: its numbers are of the scene's unit, whichever that is."""
        return self.solid


@lru_cache(maxsize=64)
def _made(radius: float, centre: tuple[float, float, float]) -> Solid:
    import trimesh  # half a second to load

    round_ = trimesh.creation.icosphere(subdivisions=_DIVIDED, radius=1.0)
    faces = tuple(tuple(face) for face in round_.faces.tolist())
    return Solid(
        vertex_names=tuple(f"p{i}" for i in range(1, len(round_.vertices) + 1)),
        vertices=np.array(centre) + radius * np.array(round_.vertices),
        faces=faces,
        edges=tuple(
            Edge(f"s{i}", tuple(ends), tuple(pair), True, "smooth")
            for i, (ends, pair) in enumerate(
                zip(round_.face_adjacency_edges.tolist(), round_.face_adjacency.tolist(), strict=True), 1
            )
        ),
        curved=(Curved("ball", Sphere(centre, radius), tuple(range(len(faces)))),),
    )
