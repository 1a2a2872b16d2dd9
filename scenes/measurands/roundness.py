"""How far a circle or the outline of a ball is from round."""

from __future__ import annotations

from scenes.measurands.features import Wall
from scenes.measurands.form import Form
from scenes.measurands.kind import MEASURANDS
from scenes.parts.surfaces import Sphere


class Roundness(Form):
    """Distance between the two circles about a least-squares circle's centre that hold all points of a rim.

    ISO 12181-1: RONt (peak to valley) about LSCI, in the circle's own plane; of a ball that of its outline. Where part
    of the rim cannot be measured, of the rest, about the circle through that.
    """

    features = ("r",)
    reference = "circle"

    def check(self, solid, key, quantity) -> None:
        """A circle, an arc or a ball: the outline of another wall is no section across it."""
        feature = quantity.features[0]
        if isinstance(feature, Wall) and not isinstance(solid.round(feature.surface).surface, Sphere):
            raise ValueError(f"{key} must be a circle or a ball for kind roundness, got {feature.surface!r}")


MEASURANDS.add("roundness")(Roundness())
