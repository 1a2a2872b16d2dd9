"""How far a line or a point is from the middle that a datum has, twice."""

from __future__ import annotations

from scenes.measurands.evaluated import Evaluated, across_line
from scenes.measurands.features import is_line
from scenes.measurands.kind import MEASURANDS, MeasurandKind, turn


class Symmetry(MeasurandKind):
    """Offset of a centre line's middle, or of a point, from a datum line; its zone is twice as wide as that.

    ISO 1101: what is toleranced lies between two lines, ``tolerance`` apart, symmetrically about the datum. Of a centre
    line its middle is asked; how far it is turned is its parallelism.
    """

    features = ("ee", "pe")
    nominals = 0
    zone = 2.0
    takes_material = True

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """Positive to the left of the datum line, seen from outside."""
        feature, datum = quantity.features
        point = seen.middle(feature, plane) if is_line(feature) else seen.point(feature, plane)
        line = seen.line(datum, plane)
        found = across_line(line.start, point, line, plane)
        return found.times(turn(seen, quantity, in_space=plane is not None))


MEASURANDS.add("symmetry")(Symmetry())
