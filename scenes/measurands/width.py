"""The width from the middle of one edge to the line of another."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, from_line
from scenes.measurands.features import along_of, points_of
from scenes.measurands.kind import MEASURANDS, MeasurandKind, side

_STEEPEST = np.sin(np.radians(30))


class Width(MeasurandKind):
    """Between two edges that are nearly parallel."""

    features = ("ee",)
    qif = "Width"

    def check(self, solid, key, quantity) -> None:
        """Within 30 degrees of parallel."""
        super().check(solid, key, quantity)
        one, other = (along_of(solid, feature) for feature in quantity.features)
        if np.linalg.norm(np.cross(one, other)) > _STEEPEST:
            raise ValueError(f"{key} must be edges within 30 degrees of parallel, got {', '.join(quantity.edges)}")

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """Distance of the first edge's middle from the second edge's line."""
        first, second = quantity.features
        points = points_of(seen.solid, quantity)
        line = points[2], points[3] - points[2]
        sign = side(seen, quantity, points[:2].mean(0), line, in_space=plane is not None)
        return from_line(seen.middle(first, plane), seen.line(second, plane), plane, sign)


MEASURANDS.add("width")(Width())
