"""Width and length of a slot with round ends."""

from __future__ import annotations

from scenes.measurands.evaluated import Evaluated, between, total
from scenes.measurands.kind import MEASURANDS, MeasurandKind

_ALIKE = 1e-3  # of a radius


class Slot(MeasurandKind):
    """Of its two round ends: NAME.width is the sum of their radii, NAME.length that and how far they are apart.

    Its centre is a feature, the midpoint of both (`between.Midpoint`).
    """

    features = ("cc",)
    parts = "width", "length"
    nominals = 2

    def check(self, solid, key, quantity) -> None:
        """Round ends of one radius in one plane."""
        super().check(solid, key, quantity)
        one, other = (solid.circle(feature.circle) for feature in quantity.features)
        if abs(one.radius - other.radius) > _ALIKE * one.radius:
            raise ValueError(f"{key} must be round ends of one radius, got {one.radius:g} and {other.radius:g}")

    def in_image(self, seen, quantity) -> Evaluated:
        """Radii as they are parallel to the image, and the distance of the centres."""
        radii = [MEASURANDS["radius"].in_image(seen, quantity.of(feature)) for feature in quantity.features]
        return total([*radii, *self._apart(seen, quantity, None)])

    def on_plane(self, seen, quantity) -> Evaluated:
        """In the scene's unit."""
        radii = [MEASURANDS["radius"].on_plane(seen, quantity.of(feature)) for feature in quantity.features]
        return total([*radii, *self._apart(seen, quantity, seen.solid.circle(quantity.edges[0]).axis)])

    def _apart(self, seen, quantity, plane) -> list[Evaluated]:
        if quantity.part == "width":
            return []
        return [between(*(seen.point(feature, plane) for feature in quantity.features))]


MEASURANDS.add("slot")(Slot())
