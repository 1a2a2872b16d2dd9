"""How far the centres of two circles are from being one."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, pulled
from scenes.measurands.features import Centre, basic_of, is_line
from scenes.measurands.kind import MEASURANDS, MeasurandKind

_UPRIGHT = 1e-6  # sine of the angle between axes that are one


class Concentricity(MeasurandKind):
    """A circle's centre from that of a datum circle, as x and y along two axes of the datum's plane (`Circle.axes`).

    The middle of a slot or the centre of a pattern of bores may stand for either.

    ISO 1101: the centre lies in a circle about the datum's, whose diameter is ``tolerance``: twice the distance must
    not exceed it. Of circles at different heights, as of a stepped bore, it is coaxiality.
    """

    features = ("cc",)
    wanted = "a circle or what lies between circles, then another"
    is_flat = False
    parts = "x", "y"
    nominals = 0
    zone = 2.0
    takes_material = True

    def takes(self, features) -> bool:
        """Circles, middles of two and centres of patterns."""
        return len(features) == 2 and all(
            not is_line(each) and all(isinstance(part, Centre) for part in basic_of((each,))) for each in features
        )

    def check(self, solid, key, quantity) -> None:
        """Of parallel axes."""
        axes = np.array([solid.circle(each.circle).axis for each in quantity.basic])
        if np.linalg.norm(np.cross(axes[0], axes), axis=-1).max() > _UPRIGHT:
            raise ValueError(f"{key} must be circles in parallel planes, got {', '.join(quantity.edges)}")

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """The way from the datum's centre, along one of the axes or along its image."""
        circle, datum = (seen.point(feature, plane) for feature in quantity.features)
        unit = self._axis(seen, quantity, plane)
        value = np.einsum("...i,...i->...", circle.at - datum.at, unit)
        return Evaluated(value, pulled([(unit, circle.moves), (-unit, datum.moves)]))

    def on_plane(self, seen, quantity) -> Evaluated:
        """Each centre in its circle's own plane."""
        return self.evaluated(seen, quantity, _datum(seen, quantity).axis)

    def _axis(self, seen, quantity, plane) -> np.ndarray:
        datum = _datum(seen, quantity)
        axis = datum.axes[quantity.axis]
        if plane is not None:
            return axis
        along = seen.slid(datum.centre, axis)
        return along / np.linalg.norm(along, axis=-1, keepdims=True)


def _datum(seen, quantity):
    """The datum's circle, or the first of those that it lies between."""
    return seen.solid.circle(quantity.features[1].edges[0])


MEASURANDS.add("concentricity")(Concentricity())
MEASURANDS.add("coaxiality")(Concentricity())
