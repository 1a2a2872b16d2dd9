"""A kind of measurand of a user's own: how far two circles are from having one centre, along a datum edge."""

import numpy as np

from scenes.measurands.evaluated import Evaluated, across, pulled
from scenes.measurands.kinds import MEASURANDS, MeasurandKind


class Eccentricity(MeasurandKind):
    """The offset of the first centre from the second along an edge: signed, so that its law is that of any length."""

    features = ("ppe",)
    is_flat = False

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """Along the edge, from its first end to its last."""
        *circles, datum = quantity.features
        first, second = (seen.point(circle, plane) for circle in circles)
        line = seen.line(datum, plane)
        along = line.stop.at - line.start.at
        length = np.linalg.norm(along, axis=-1)[..., None]
        unit, away = along / length, first.at - second.at
        normal = across(unit, plane)
        lever = (away * normal).sum(-1)[..., None] / length * normal  # the datum's own turn
        moved = (unit, first.moves), (-unit, second.moves), (lever, line.stop.moves), (-lever, line.start.moves)
        return Evaluated((away * unit).sum(-1), pulled(moved))


MEASURANDS.add("eccentricity")(Eccentricity())
