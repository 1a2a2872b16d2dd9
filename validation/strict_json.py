"""JSON as all commands write it: strict, so that what is not finite is null, whatever library a number comes from."""

from __future__ import annotations

import json
import math
import numbers
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import PurePath
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """The same of what JSON has: dictionaries, lists, texts, numbers, true, false, null.

    Parameters
    ----------
    value : object
        Any nesting of mappings, lists, tuples, dataclasses, NumPy arrays, texts, paths, enumerations and real numbers
        (Python's, NumPy's, mpmath's, fractions).

    Returns
    -------
    object
        NaN and infinities become None, keys texts, dataclasses dictionaries of their fields, enumerations their values.

    Raises
    ------
    TypeError
        If something in it is of none of these kinds.
    """
    if value is None or type(value) in (bool, int, str):  # most there is, said first: checks of kinds take long
        return value
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, str | PurePath):
        return str(value)
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, numbers.Real):
        return _finite(value)
    if isinstance(value, Mapping):
        return {str(plain(key)): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    raise TypeError(f"value must be of a kind that JSON can say, got {type(value).__name__}")


def _finite(value: numbers.Real) -> float | None:
    try:
        number = float(value)
    except OverflowError:  # a fraction beyond the largest number
        return None
    return number if math.isfinite(number) else None


def dumps(value: Any, indent: int | None = 1) -> str:
    """A value's JSON text, ASCII; see `plain`."""
    return json.dumps(plain(value), indent=indent, allow_nan=False)
