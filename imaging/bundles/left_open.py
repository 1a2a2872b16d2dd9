"""Why pictures do not tell a value: what they leave open, in words."""

from __future__ import annotations

import numpy as np

from imaging.bundles.bundle import BundleAdjustment
from imaging.bundles.told import Told

_MANY = 0.3  # of the block that is open most: others as open are named, too


def left_open(adjustment: BundleAdjustment, m: int) -> str:
    """What the rows leave open on which the m-th value depends; empty where they tell it."""
    if adjustment.is_told[m]:
        return ""
    gradient, told = adjustment.bundle.nominal[1][m], adjustment.told
    if Told(np.concatenate([told.rows, _size(adjustment)[None]]), told.units).is_told(gradient[None])[0]:
        return "nothing tells the scale: where sensors stand must be known, or datums be named"
    left = told.left(gradient[None])[0]
    slices = adjustment.bundle.unknowns.slices
    shares = {name: float(np.linalg.norm(left[part])) for name, part in slices.items()}
    names = [name for name, share in shares.items() if share > _MANY * max(shares.values())]
    many = len(adjustment.whites)
    pictures = "one picture leaves" if many == 1 else f"{many} pictures leave"
    return f"{pictures} open where {', '.join(names)} {'is' if len(names) == 1 else 'are'}"


def _size(adjustment: BundleAdjustment) -> np.ndarray:
    """Derivative (n,) of how far vertices and centres are from their middle, which no motion of the part changes."""
    unknowns = adjustment.bundle.unknowns
    places = adjustment.bundle.at(np.zeros(unknowns.count)).places()
    names = [*map(unknowns.vertex, unknowns.vertices), *unknowns.circles]
    away = places - places.mean(0)
    pulls = [one @ unknowns.basis(name)[:3] for one, name in zip(away, names, strict=True)]
    return np.sum(pulls, 0) / np.linalg.norm(away)
