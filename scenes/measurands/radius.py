"""The radius of a circle, an arc, a ball or a round wall."""

from __future__ import annotations

from scenes.measurands.diameter import Diameter
from scenes.measurands.evaluated import Evaluated
from scenes.measurands.kind import MEASURANDS


class Radius(Diameter):
    """Half the diameter: of a rounded corner, a fillet, a round end."""

    qif = "Radius"

    def in_image(self, seen, quantity) -> Evaluated:
        """Of the circle that is parallel to the image."""
        return super().in_image(seen, quantity).times(0.5)

    def on_plane(self, seen, quantity) -> Evaluated:
        """The radius."""
        return super().on_plane(seen, quantity).times(0.5)


MEASURANDS.add("radius")(Radius())
