"""The height of a corner or a centre over the plane of others, which several pictures tell together."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, over_plane, plane_through
from scenes.measurands.features import Centre, Corner, check_off_line, places
from scenes.measurands.kind import MEASURANDS, MeasurandKind

_LEAST = 4
_ZERO = 1e-9  # of the part's size: a height that is none, and has no side


class Height(MeasurandKind):
    """Of a point over the least-squares plane of at least three others, along its normal."""

    features = ()
    is_flat = False
    pictures = 2

    @property
    def wanted(self) -> str:
        """In words."""
        return "a corner or a circle, then at least three"

    def takes(self, features) -> bool:
        """Points alone."""
        return len(features) >= _LEAST and all(isinstance(each, Corner | Centre) for each in features)

    def check(self, solid, key, quantity) -> None:
        """Those of the plane are not on one line."""
        check_off_line(key, places(solid, quantity.features[1:]), quantity.edges)

    def evaluated(self, seen, quantity, plane) -> Evaluated:
        """The height, positive to the side where the point nominally is; upwards where it is in the plane."""
        points = [seen.point(feature, plane) for feature in quantity.features]
        centre, normal = plane_through(points[1:])
        return over_plane(points[0], centre, normal, _outside(seen.solid, quantity))


def _outside(solid, quantity) -> np.ndarray:
    """A vector (3,) to the side that counts as positive."""
    point, *others = places(solid, quantity.features)
    away = np.array(others) - np.mean(others, 0)
    normal = np.linalg.svd(away)[2][2]
    normal = normal * np.sign(normal[np.abs(normal).argmax()])
    below = normal @ (point - np.mean(others, 0)) < -_ZERO * solid.extent
    return -normal if below else normal


MEASURANDS.add("height")(Height())
