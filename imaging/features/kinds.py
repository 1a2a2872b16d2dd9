"""Value and gradient of a measurand of any kind (`scenes.measurands`), in the image and on its features' plane."""

from __future__ import annotations

from imaging.features.seen import Seen
from scenes import Quantity
from scenes.measurands.evaluated import Evaluated
from scenes.measurands.kinds import MEASURANDS

__all__ = ["Evaluated", "in_image", "on_plane"]


def in_image(seen: Seen, quantity: Quantity) -> Evaluated:
    """In the image: px, or degrees."""
    return MEASURANDS[quantity.kind].in_image(seen, quantity)


def on_plane(seen: Seen, quantity: Quantity) -> Evaluated:
    """On the plane of the features: the scene's unit, or degrees."""
    return MEASURANDS[quantity.kind].on_plane(seen, quantity)
