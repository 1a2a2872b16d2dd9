"""Value and gradient of a measurand of any kind (`scenes.measurands`), in the image and on its features' plane."""

from __future__ import annotations

import numpy as np

from imaging.features.seen import Seen
from scenes import Quantity
from scenes.measurands.evaluated import Evaluated
from scenes.measurands.features import Nominal
from scenes.measurands.kinds import MEASURANDS

__all__ = ["Evaluated", "in_image", "on_plane"]


def in_image(seen: Seen, quantity: Quantity) -> Evaluated:
    """In the image: px, or degrees; NaN of a kind that one picture does not tell."""
    kind = MEASURANDS[quantity.kind]
    return kind.in_image(seen, quantity) if kind.pictures == 1 else _untold(seen, np.nan)


def on_plane(seen: Seen, quantity: Quantity) -> Evaluated:
    """On the plane of the features: the scene's unit, or degrees; the object's own, of a kind that one picture does not
    tell, whose derivatives are NaN."""
    kind = MEASURANDS[quantity.kind]
    if kind.pictures == 1:
        return kind.on_plane(seen, quantity)
    return _untold(seen, float(kind.evaluated(Nominal(seen.solid), quantity, None).value))


def _untold(seen: Seen, value: float) -> Evaluated:
    lead = seen.start.shape[:-2] if seen.names else seen.centres.shape[:-2]
    return Evaluated(np.full(lead, value), {0: np.full(lead, np.nan)})
