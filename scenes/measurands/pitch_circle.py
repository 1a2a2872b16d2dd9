"""The diameter of the circle through the centres of some holes."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, circle_through
from scenes.measurands.features import Centre, check_off_line
from scenes.measurands.kind import MEASURANDS, MeasurandKind


class PitchCircle(MeasurandKind):
    """Of at least three circles in one plane, by least squares; its centre is a feature (`between.PitchCircle`)."""

    features = ()

    @property
    def wanted(self) -> str:
        """In words."""
        return "at least three circles"

    def takes(self, features) -> bool:
        """Circles alone."""
        return len(features) > 2 and all(isinstance(feature, Centre) for feature in features)

    def check(self, solid, key, quantity) -> None:
        """Not on one line."""
        super().check(solid, key, quantity)
        points = np.array([solid.circle(feature.circle).centre for feature in quantity.features])
        check_off_line(key, points, quantity.edges)

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """Twice the radius."""
        return circle_through([seen.point(feature, plane) for feature in quantity.features], plane)[1].times(2.0)


MEASURANDS.add("pitch_circle")(PitchCircle())
