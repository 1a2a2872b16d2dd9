"""Why pictures do not tell a value: what they leave open, in words."""

from __future__ import annotations

import numpy as np

from imaging.bundles.bundle import BundleAdjustment
from imaging.bundles.told import Told
from imaging.features.displaced import steps
from imaging.geometry.projection import sensor_position

_MANY = 0.3  # of the block that is open most: others as open are named, too


def left_open(adjustment: BundleAdjustment, m: int) -> str:
    """What the rows leave open on which the m-th value depends; empty where they tell it."""
    if adjustment.is_told[m]:
        return ""
    gradient, told = adjustment.bundle.nominal[1][m], adjustment.told
    if Told(np.concatenate([told.rows, _apart(adjustment)[None]]), told.units).is_told(gradient[None])[0]:
        return "nothing tells the scale: where sensors stand must be known, or datums be named"
    left = told.left(gradient[None])[0]
    slices = adjustment.bundle.unknowns.slices
    shares = {name: float(np.linalg.norm(left[part])) for name, part in slices.items()}
    names = [name for name, share in shares.items() if share > _MANY * max(shares.values())]
    many = len(adjustment.whites)
    pictures = "one picture leaves" if many == 1 else f"{many} pictures leave"
    return f"{pictures} open where {', '.join(names)} {'is' if len(names) == 1 else 'are'}"


def _apart(adjustment: BundleAdjustment) -> np.ndarray:
    """Derivative (n,) of how far the first and the last sensor are apart, which no motion of all together changes."""
    places, moves = [], []
    for k in (1, len(adjustment.bundle.seen)):
        seen = adjustment.bundle.seen[k - 1]
        places.append(sensor_position(seen.camera, seen.sensors))
        turned = steps(places[-1][None], np.array(seen.camera.look_at))[0]
        moves.append(turned @ adjustment.bundle.unknowns.basis(f"sensor {k}"))
    return (places[1] - places[0]) @ (moves[1] - moves[0])
