"""How far an edge is from square to a datum edge, over its own length."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, along_line
from scenes.measurands.features import along_of
from scenes.measurands.kind import MEASURANDS, MeasurandKind

_MOST = np.sin(np.radians(1.0))  # cosine of an angle that is meant to be a right one


class Perpendicularity(MeasurandKind):
    """How far the edge's last end is from its first along the datum: the signed width of the zone that it needs.

    ISO 1101: the edge lies between two parallel lines, ``tolerance`` apart, which are square to the datum.
    """

    features = ("ee",)
    nominals = 0
    zone = 1.0

    def check(self, solid, key, quantity) -> None:
        """Within 1 degree of square."""
        super().check(solid, key, quantity)
        one, datum = (along_of(solid, feature) for feature in quantity.features)
        if abs(one @ datum) > _MOST:
            raise ValueError(f"{key} must be edges within 1 degree of square, got {', '.join(quantity.edges)}")

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """Positive where the edge leans the way that the datum goes, from its first end to its last."""
        edge, datum = (seen.line(feature, plane) for feature in quantity.features)
        return along_line(edge.start, edge.stop, datum)


MEASURANDS.add("perpendicularity")(Perpendicularity())
