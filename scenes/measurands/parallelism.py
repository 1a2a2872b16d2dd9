"""How far an edge is from parallel to a datum edge, over its own length."""

from __future__ import annotations

from scenes.measurands.evaluated import Evaluated, across_line
from scenes.measurands.features import check_parallel
from scenes.measurands.kind import MEASURANDS, MeasurandKind, turn


class Parallelism(MeasurandKind):
    """How far the edge's last end is from its first across the datum: the signed width of the zone that it needs.

    ISO 1101: the edge lies between two parallel lines, ``tolerance`` apart, which are parallel to the datum.
    """

    features = ("ee",)
    nominals = 0
    zone = 1.0

    def check(self, solid, key, quantity) -> None:
        """Within 1 degree of parallel."""
        super().check(solid, key, quantity)
        check_parallel(solid, key, quantity.features, quantity.edges)

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """Positive where the edge turns to the left of the datum, seen from outside."""
        edge, datum = (seen.line(feature, plane) for feature in quantity.features)
        found = across_line(edge.start, edge.stop, datum, plane)
        return found.times(turn(seen, quantity, in_space=plane is not None))


MEASURANDS.add("parallelism")(Parallelism())
