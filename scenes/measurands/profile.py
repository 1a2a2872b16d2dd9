"""How far an edge, a circle or the outline of a ball is from its nominal place and shape: the profile of a line."""

from __future__ import annotations

from scenes.measurands.features import Centre, Side, Wall
from scenes.measurands.form import Form
from scenes.measurands.kind import MEASURANDS
from scenes.parts.surfaces import Sphere


class Profile(Form):
    """Width of the zone about a feature's nominal line that holds all its points: twice the farthest one's distance.

    ISO 1101, ISO 1660: nominal is what the scene says, its place in the scene's own coordinates, in which the camera
    stands. What is not known of the camera's place is therefore part of U. Nothing is fitted.
    """

    features = ("e", "r")
    reference = "nominal"

    def check(self, solid, key, quantity) -> None:
        """An edge of the part, a circle, an arc or a ball: other outlines are no lines of the part."""
        feature = quantity.features[0]
        if isinstance(feature, Wall) and not isinstance(solid.round(feature.surface).surface, Sphere):
            raise ValueError(f"{key} must be an edge, a circle or a ball for kind profile, got {feature.surface!r}")
        if not isinstance(feature, Wall | Side | Centre):
            raise ValueError(f"{key} must be an edge of the part for kind profile, got {', '.join(quantity.edges)}")


MEASURANDS.add("profile")(Profile())
