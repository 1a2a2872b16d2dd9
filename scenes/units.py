"""Units of length. A scene keeps its own throughout: no formula knows an absolute length, so nothing is converted."""

from __future__ import annotations

from typing import Literal, get_args

Unit = Literal["mm", "cm", "m", "inch"]
UNITS: tuple[Unit, ...] = get_args(Unit)
_IN_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}


def in_unit(length: float, unit: Unit, wanted: Unit) -> float:
    """A length in another unit.

    Examples
    --------
    >>> in_unit(2.0, "inch", "mm"), in_unit(2.5, "cm", "cm"), in_unit(60, "mm", "cm")
    (50.8, 2.5, 6.0)
    """
    return length if unit == wanted else length * _IN_MM[unit] / _IN_MM[wanted]


def times_apart(ratio: float) -> float:
    """How far a positive ratio is from 1, alike both ways.

    >>> times_apart(0.25), times_apart(4.0)
    (4.0, 4.0)
    """
    return max(ratio, 1 / ratio)
