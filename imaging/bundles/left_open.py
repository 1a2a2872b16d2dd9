"""Why pictures do not tell a value: what they leave open, in words."""

from __future__ import annotations

import numpy as np

from imaging.bundles.bundle import Adjustment
from imaging.geometry.projection import sensor_position

_ALONE = 1e-6  # of a direction: the part of it that is another one
_MANY = 0.3  # of the block that is open most: others as open are named, too


def left_open(adjustment: Adjustment, m: int) -> str:
    """What the rows leave open on which the m-th value depends; empty where they tell it."""
    if adjustment.is_told[m]:
        return ""
    left = adjustment.told.left(adjustment.bundle.nominal[1][m][None])[0]
    scale = _scale(adjustment)
    if scale is not None and np.linalg.norm(left - (left @ scale) * scale) < _ALONE * np.linalg.norm(left):
        return "nothing tells the scale: where sensors stand must be known, or datums be named"
    slices = adjustment.bundle.unknowns.slices
    shares = {name: float(np.linalg.norm(left[part])) for name, part in slices.items()}
    names = [name for name, share in shares.items() if share > _MANY * max(shares.values())]
    many = len(adjustment.whites)
    pictures = "one picture leaves" if many == 1 else f"{many} pictures leave"
    return f"{pictures} open where {', '.join(names)} {'is' if len(names) == 1 else 'are'}"


def _scale(adjustment: Adjustment) -> np.ndarray | None:
    """Direction (n,), in the units of `Told`, of all growing alike about the point looked at; None if it is told."""
    bundle, unknowns = adjustment.bundle, adjustment.bundle.unknowns
    scene, pivot = unknowns.scene, np.array(unknowns.scene.camera.look_at)
    grown = {unknowns.vertex(i): scene.solid.vertices[i] - pivot for i in unknowns.vertices}
    for name in unknowns.circles:
        circle = scene.solid.circle(name)
        grown[name] = np.array([*(circle.centre - pivot), 0.0, 0.0, circle.radius])
    for k, seen in enumerate(bundle.seen, 1):
        grown[f"sensor {k}"] = np.array([*(sensor_position(seen.camera, seen.sensors) - pivot), 0.0, 0.0, 0.0])
    numbers = np.zeros(unknowns.count)
    for name, full in grown.items():
        basis = unknowns.basis(name)
        own = basis.T @ full
        if np.linalg.norm(basis @ own - full) > _ALONE * np.linalg.norm(full):
            return None
        numbers += own
    direction = numbers / adjustment.told.units
    direction = direction / np.linalg.norm(direction)
    return direction if np.linalg.norm(adjustment.told.open @ direction) > 1 - _ALONE else None
