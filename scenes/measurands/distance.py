"""The distance between two corners or centres of circles."""

from __future__ import annotations

from scenes.measurands.evaluated import Evaluated, between
from scenes.measurands.kind import MEASURANDS, MeasurandKind


class Distance(MeasurandKind):
    """Between two points, each found for itself."""

    features = ("pp",)
    qif = "DistanceBetween"
    is_flat = False

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """The distance."""
        return between(*(seen.point(feature, plane) for feature in quantity.features))


MEASURANDS.add("distance")(Distance())
