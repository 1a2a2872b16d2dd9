"""The angle between two edges."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, between_lines
from scenes.measurands.features import Side, along_of
from scenes.measurands.kind import MEASURANDS, MeasurandKind

_PARALLEL = 1e-6  # sine of an angle that is none


class Angle(MeasurandKind):
    """Between two lines, from their common vertex if they have one."""

    features = ("ee",)
    qif = "AngleBetween"
    is_angle = True

    def check(self, solid, key, quantity) -> None:
        """Not parallel."""
        super().check(solid, key, quantity)
        if np.linalg.norm(np.cross(*(along_of(solid, feature) for feature in quantity.features))) < _PARALLEL:
            raise ValueError(f"{key} must be edges that are not parallel, got {', '.join(quantity.edges)}")

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """The angle, degrees."""
        ends = [_vertices(seen.solid, feature) for feature in quantity.features]
        shared = set(ends[0]) & set(ends[1])
        signs = [1 if not shared or pair[0] in shared else -1 for pair in ends]
        return between_lines([seen.line(feature, plane) for feature in quantity.features], signs, plane)


def _vertices(solid, feature) -> tuple[int, ...]:
    """Of an edge; a line between others has none."""
    return solid.edge(feature.edge).ends if isinstance(feature, Side) else ()


MEASURANDS.add("angle")(Angle())
