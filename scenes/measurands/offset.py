"""The offset of a corner or a centre from the line of an edge."""

from __future__ import annotations

from scenes.measurands.evaluated import Evaluated, from_line
from scenes.measurands.features import points_of
from scenes.measurands.kind import MEASURANDS, MeasurandKind, side


class Offset(MeasurandKind):
    """Of a point from a line."""

    features = ("pe",)

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """The distance from the line, positive where it nominally is."""
        feature, datum = quantity.features
        points = points_of(seen.solid, quantity)
        line = points[1], points[2] - points[1]
        sign = side(seen, quantity, points[0], line, in_space=plane is not None)
        return from_line(seen.point(feature, plane), seen.line(datum, plane), plane, sign)


MEASURANDS.add("offset")(Offset())
