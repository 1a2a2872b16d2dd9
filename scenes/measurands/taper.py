"""The taper of a cone: the angle between opposite lines of its wall."""

from __future__ import annotations

import numpy as np

from scenes.measurands.evaluated import DEGREE, Evaluated
from scenes.measurands.kind import MEASURANDS, MeasurandKind
from scenes.parts.surfaces import Cone


class Taper(MeasurandKind):
    """Twice a cone's half angle."""

    features = ("s",)
    is_angle = True

    def check(self, solid, key, quantity) -> None:
        """Of a cone."""
        name = quantity.features[0].surface
        if not isinstance(solid.round(name).surface, Cone):
            raise ValueError(f"{key} must be a cone for kind taper, got {name!r}")

    def in_image(self, seen, quantity) -> Evaluated:
        """No foreshortening: what it is on the object."""
        return self.on_plane(seen, quantity)

    def on_plane(self, seen, quantity) -> Evaluated:
        """The angle, degrees."""
        angle, number = seen.half_angle(quantity.features[0])
        sign = np.sign(seen.solid.round(quantity.features[0].surface).half_angle)
        return Evaluated(2 * DEGREE * sign * angle, {number: np.full(np.shape(angle), 2 * DEGREE * sign)})


MEASURANDS.add("taper")(Taper())
