"""What results are made of as JSON documents, and where two of these differ: for tests against stored numbers."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pydantic

from render import variant

CLOSED, SEARCHED, RENDERED = 1e-6, 2e-3, 5e-2  # relative; measured: 1e-12, 1e-6, 9e-3 where Embree has no AVX
TRACED = 5e-5  # of light that goes between a part and its floor; measured: 4e-6 where BLAS or Embree has other kernels
_ELSEWHERE = ("seconds", "variant", "machines", "file", "dask")  # keys of what another machine may say
_INSIDE = ("scene", "picture", "pictures", "solid", "store", "noise_free")  # attributes: what a result is of
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_ZERO = 1e-12  # of what cancels in numbers of size 1 to 100; measured: 3e-14
_MOST = 24  # numbers of an array that are stored one by one
_DEEP = 9


@functools.cache
def read(stored: Path) -> dict[str, Any]:
    """The documents by name."""
    return json.loads(stored.read_text(encoding="utf-8"))


def write(stored: Path, documents: dict[str, Any]) -> None:
    """Store documents by name, a line each."""
    lines = [f"{json.dumps(name)}: {json.dumps(made)}" for name, made in documents.items()]
    stored.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


@contextmanager
def uncompiled() -> Iterator[None]:
    """Pictures are rendered as everywhere: rays of a compiled variant are others."""
    try:
        with mock.patch.dict(os.environ, {variant.OVERRIDE: variant.SCALAR}):
            variant.choose.cache_clear()
            yield
    finally:
        variant.choose.cache_clear()


def told(value: Any, deep: int = 0) -> Any:
    """A result as JSON: records by attribute, arrays as lists, large ones by sums that tell their order.

    >>> told({"at": np.array([[1.0, np.inf]]), "is": np.bool_(True)})
    {'at': {'shape': [1, 2], 'values': [1.0, 'inf']}, 'is': True}
    """
    if value is None or isinstance(value, str | bool | np.bool_):
        return bool(value) if isinstance(value, np.bool_) else value
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return _number(float(value))
    if isinstance(value, np.ndarray):
        return _array(value)
    if deep > _DEEP or callable(value):
        return type(value).__name__
    if isinstance(value, dict):
        return {str(key): told(each, deep + 1) for key, each in value.items()}
    if isinstance(value, tuple | list | set | frozenset):
        if hasattr(value, "_fields"):
            return {name: told(getattr(value, name), deep + 1) for name in value._fields if name not in _INSIDE}
        return [told(each, deep + 1) for each in (sorted(value) if isinstance(value, set | frozenset) else value)]
    if dataclasses.is_dataclass(value):
        names = [each.name for each in dataclasses.fields(value)]
    elif isinstance(value, pydantic.BaseModel):
        names = list(type(value).model_fields)
    else:
        return type(value).__name__
    names = [name for name in names if not name.startswith("_") and name not in _INSIDE]
    return {name: told(getattr(value, name), deep + 1) for name in names}


def _number(value: float) -> float | str:
    return float(f"{value:.12g}") if math.isfinite(value) else str(value)


def _array(values: np.ndarray) -> Any:
    if values.dtype.kind not in "fiub" or values.size <= _MOST:
        flat = [told(each.item() if isinstance(each, np.generic) else each) for each in values.ravel()]
        return {"shape": list(values.shape), "values": flat}
    numbers = values.astype(float).ravel()
    known = np.isfinite(numbers)
    at = np.flatnonzero(known)
    sums = [float(np.sum(np.abs(numbers[at]))), float(np.sum(numbers[at]))]
    sums += [float(np.sum(numbers[at] * np.cos(turn * at + 1))) for turn in (0.37, 2.1)]
    return {"shape": list(values.shape), "finite": int(known.sum()), "sums": [_number(each) for each in sums]}


def differences(stored, found, rel, where="", size=0.0) -> Iterator[str]:
    """Where two documents differ, as "key: stored, found"; ``size`` is what a number near zero is small against."""
    if isinstance(stored, dict) and isinstance(found, dict):
        spread = _spread(stored)
        for key in dict.fromkeys([*stored, *found]):
            if key not in _ELSEWHERE:
                yield from differences(stored.get(key), found.get(key), rel, f"{where}.{key}", spread)
    elif isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        numbers = [abs(value) for value in stored if isinstance(value, int | float)]
        for i, pair in enumerate(zip(stored, found, strict=True)):
            yield from differences(*pair, rel, f"{where}[{i}]", max(numbers, default=size))
    elif not _alike(stored, found, rel, size):
        yield f"{where.lstrip('.')}: {stored}, {found}"


def _spread(row: dict) -> float:
    """One standard deviation of what a row is about, which its biases are small against."""
    variances = [row.get(key) for key in ("empirical", "variance", "variance_object") if _is_size(row.get(key))]
    sigmas = [row.get(key) for key in ("sigma", "u", "measured") if _is_size(row.get(key))]
    return max([*(math.sqrt(v) for v in variances), *sigmas], default=0.0)


def _is_size(value: Any) -> bool:
    return isinstance(value, int | float) and value > 0


def _alike(stored, found, rel, size):
    if isinstance(stored, str) and isinstance(found, str):
        pairs = zip(_NUMBER.findall(stored), _NUMBER.findall(found), strict=False)
        same = _NUMBER.sub("#", stored) == _NUMBER.sub("#", found)
        # a last digit of two; what is smaller than any result is rounding
        return same and all(math.isclose(float(a), float(b), rel_tol=0.05, abs_tol=1e-9) for a, b in pairs)
    if isinstance(stored, bool) or stored is None or isinstance(stored, int):
        return stored == found
    return isinstance(found, int | float) and math.isclose(stored, found, rel_tol=rel, abs_tol=rel * size + _ZERO)


Case = tuple[float, Callable[[], Any]]  # relative tolerance, and what makes the result
