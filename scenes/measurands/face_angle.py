"""The angle between two plane faces, each by two of its edges, which several pictures tell together."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, between_planes, plane_through
from scenes.measurands.kind import MEASURANDS, MeasurandKind
from scenes.parts.solid import Solid


class FaceAngle(MeasurandKind):
    """180 degrees less the angle between the faces' outward normals: that of the wedge which they enclose."""

    features = ("eeee",)
    is_angle = True
    is_flat = False
    pictures = 2
    qif = "AngleBetween"

    def check(self, solid, key, quantity) -> None:
        """The first two edges are of one face, the last two of another that is not parallel."""
        normals = [solid.normals[_face(solid, key, pair)] for pair in _pairs(quantity)]
        if np.linalg.norm(np.cross(*normals)) < _PARALLEL:
            raise ValueError(f"{key} must be edges of two faces that are not parallel, got {', '.join(quantity.edges)}")

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """The angle, degrees, of the least-squares planes of both faces' edges."""
        normals, outside = [], []
        for pair in _pairs(quantity):
            lines = [seen.line(edge, plane) for edge in pair]
            ends = [end for line in lines for end in (line.start, line.stop)]
            normals.append(plane_through(ends)[1])
            outside.append(seen.solid.normals[_face(seen.solid, quantity.name, pair)])
        return between_planes(normals, outside)


_PARALLEL = 1e-6  # sine of an angle that is none


def _pairs(quantity) -> tuple[tuple, tuple]:
    return quantity.features[:2], quantity.features[2:]


def _face(solid: Solid, key: str, pair: tuple) -> int:
    """The face that both edges of a pair bound."""
    faces = [set(solid.edge(side.edge).faces) for side in pair]
    both = sorted(faces[0] & faces[1])
    if not both:
        raise ValueError(
            f"{key} must be two edges of a face, then two of another, got {', '.join(s.edge for s in pair)}"
        )
    return both[0]


MEASURANDS.add("face_angle")(FaceAngle())
