"""The decision rule of ISO 14253-1. The standard library alone: a recipe (`validation.recipe`) has this file."""

from __future__ import annotations

import math
from typing import Literal

from scenes.status import OK, is_trusted

Decision = Literal["pass", "fail", "undecided"]


def decided(value: float, limits: tuple[float, float], U: float, status: str = OK) -> Decision:
    """``pass`` where a value keeps both limits by U, ``fail`` where it breaks one by more; only what is trusted.

    >>> [decided(value, (9.98, 10.02), 0.008) for value in (10.011, 10.013, 10.029)]
    ['pass', 'undecided', 'fail']
    """
    if not (is_trusted(status) and math.isfinite(value) and math.isfinite(U)):
        return "undecided"
    inside = min(value - limits[0], limits[1] - value)
    if inside >= U:
        return "pass"
    return "fail" if inside < -U else "undecided"
