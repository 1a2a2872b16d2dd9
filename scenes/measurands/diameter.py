"""The diameter of a circle, a ball or a round wall."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import Evaluated, pulled
from scenes.measurands.kind import MEASURANDS, MeasurandKind


class Diameter(MeasurandKind):
    """Of a circle; a cone's in its middle."""

    features = ("r",)
    qif = "Diameter"

    def in_image(self, seen, quantity) -> Evaluated:
        """Of the diameter that is parallel to the image: 2 r f / z, z the depth of the centre; no foreshortening.

        Of a camera that is no pinhole z is its divisor there, which changes with the depth by the share of perspective.
        """
        _, centre, radius, number = seen.circle(quantity.features[0])
        over, share = seen.divisor(centre.at), seen.camera.perspective
        per_length = seen.camera.focal_px / over
        forward = -2 * share * (radius * per_length / over)[..., None] * seen.axes.forward
        return Evaluated(2 * radius * per_length, {**pulled([(forward, centre.moves)]), number: 2 * per_length})

    def on_plane(self, seen, quantity) -> Evaluated:
        """Twice the radius."""
        _, _, radius, number = seen.circle(quantity.features[0])
        return Evaluated(2 * radius, {number: np.full(np.shape(radius), 2.0)})


MEASURANDS.add("diameter")(Diameter())
