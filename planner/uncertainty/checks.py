"""What numbers of a budget must be."""

from __future__ import annotations

import math

from scenes.errors import InvalidInput


def check_finite(name: str, value: float) -> None:
    """See that it is neither NaN nor infinite."""
    if not math.isfinite(value):
        raise InvalidInput(f"{name} must be a finite number, got {value}")


def check_not_negative(name: str, value: float) -> None:
    """See that it is finite and at least 0."""
    if not 0 <= value < math.inf:
        raise InvalidInput(f"{name} must be a finite number of at least 0, got {value}")


def check_positive(name: str, value: float) -> None:
    """See that it is finite and greater than 0."""
    if not 0 < value < math.inf:
        raise InvalidInput(f"{name} must be a finite number greater than 0, got {value}")
