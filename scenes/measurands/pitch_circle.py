"""The diameter of the circle through the centres of some holes."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, circle_through
from scenes.measurands.features import Centre
from scenes.measurands.kind import MEASURANDS, MeasurandKind

_OFF_LINE = 1e-3  # of the pattern's size


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
        if np.linalg.svd(points - points.mean(0))[1][1] < _OFF_LINE * np.ptp(points, axis=0).max():
            raise ValueError(f"{key} must be circles that are not on one line, got {', '.join(quantity.edges)}")

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """Twice the radius."""
        return circle_through([seen.point(feature, plane) for feature in quantity.features], plane)[1].times(2.0)


MEASURANDS.add("pitch_circle")(PitchCircle())
