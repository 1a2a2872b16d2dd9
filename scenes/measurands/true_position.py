"""The position of a point about its true place in a datum system that is measured, too (ISO 1101, 5458, 5459)."""

from __future__ import annotations

from scenes.measurands.evaluated import Evaluated, Line, across_line, along_line
from scenes.measurands.features import Centre, are_level, found_at, is_flat, is_line
from scenes.measurands.kind import MEASURANDS, MeasurandKind, turn


class TruePosition(MeasurandKind):
    """A point's coordinates x and y in a datum system of two measured features; its zone is a circle about both.

    The primary datum says where y is 0, and the direction of x where it is a line; the secondary, an edge's middle or a
    point, where x is 0. Where the primary is a point, it is the origin, and the secondary says the direction of x: an
    edge's, or from the origin to a second point. ``tolerance`` is the zone's diameter: twice the distance from the true
    place, the nominal x and y, must not exceed it.
    """

    features = ("pee", "pep", "ppe", "ppp")
    parts = "x", "y"
    nominals = 2
    zone = 2.0
    takes_material = True
    is_flat = False

    def check(self, solid, key, quantity) -> None:
        """In one plane; of circles alone in parallel planes, along whose axis it is then seen."""
        features = quantity.basic
        circles = [solid.circle(each.circle) for each in features if isinstance(each, Centre)]
        if not (are_level(circles, features) or is_flat(found_at(solid, quantity), solid.extent)):
            raise ValueError(f"{key} must be features in one plane, got {', '.join(quantity.edges)}")

    def needed(self, features, name) -> tuple:
        """For y from a line that line alone."""
        return features[:2] if name.endswith(".y") and is_line(features[1]) else features

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """x along the datum direction, y to the left of it, seen from outside."""
        feature, primary, *secondary = quantity.features
        point = seen.point(feature, plane)
        if is_line(primary):
            axis = seen.line(primary, plane)
            origin = _on(seen, secondary[0], plane) if secondary else axis.start
        else:
            origin = seen.point(primary, plane)
            clock = secondary[0]
            axis = seen.line(clock, plane) if is_line(clock) else Line(origin, seen.point(clock, plane))
        if quantity.part == "x":
            return along_line(origin, point, axis)
        return across_line(origin, point, axis, plane).times(turn(seen, quantity, in_space=plane is not None))


def _on(seen, datum, plane):
    """A datum's place: of an edge its middle."""
    return seen.middle(datum, plane) if is_line(datum) else seen.point(datum, plane)


MEASURANDS.add("true_position")(TruePosition())
