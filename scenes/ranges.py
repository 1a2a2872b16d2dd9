"""Ranges of numbers: wide enough for every use, narrow enough that no square or product leaves floating point."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

from pydantic import AfterValidator, Field

LEAST_SIGMA = 1e-15  # grey levels; the square of less, and the square of that, would be lost


def _none_or_some(value: float) -> float:
    if 0 < value < LEAST_SIGMA:
        raise ValueError(f"noise.sigma must be 0 or at least {LEAST_SIGMA:g}, got {value:g}")
    return value


def _zero_or(least: float) -> AfterValidator:
    def checked(value: float) -> float:
        if 0 < value < least:  # as above
            raise ValueError(f"number must be 0 or at least {least:g}, got {value:g}")
        return value

    return AfterValidator(checked)


Positive = Annotated[float, Field(gt=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Length = Annotated[float, Field(ge=1e-12, le=1e12)]  # in the scene's unit
Level = Annotated[float, Field(ge=1e-15, le=1e15)]  # grey levels
Coordinate = Annotated[float, Field(ge=-1e12, le=1e12)]  # in the scene's unit
Spread = Annotated[float, Field(ge=0, le=1e12), _zero_or(1e-30)]  # a standard uncertainty, of any unit
Rounding = Annotated[float, Field(ge=0, le=1e12), _zero_or(1e-29)]  # a step; half of it is a Spread
Bounded = Annotated[float, Field(ge=-1e30, le=1e30)]  # grey levels^2
Darkness = Annotated[float, Field(ge=0, le=1e15)]  # grey levels
Trace = Annotated[float, Field(ge=0, le=1e15), AfterValidator(_none_or_some)]  # grey levels


NotNegative = Annotated[float, Field(ge=0)]
Curve = tuple[tuple[Positive, NotNegative], ...]


def rising(key: str, rows: tuple) -> tuple:
    """The rows of a table, once their wavelengths are known to rise."""
    if any(a[0] >= b[0] for a, b in pairwise(rows)):
        raise ValueError(f"{key} must be rows of rising wavelength, got {[row[0] for row in rows]}")
    return rows
