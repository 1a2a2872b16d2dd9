"""A value told in few digits: what is exact in it as a hash, all its numbers as one.

Two values that differ by rounding differ as little in that one number; where a number, an order, a sign, a shape, a
count or a word of them is another, so is the digest.
"""

from __future__ import annotations

import dataclasses
import enum
import math
import re
import zlib
from itertools import islice
from typing import Any, NamedTuple

import mpmath
import numpy as np
import pydantic
from scipy import sparse

_SMALL = 1e-9  # what is below it counts as 0: of numbers of size 1 to 100 that cancel, 3e-14 are left
_MOST = 4096  # numbers of an array, evenly spread, that are looked at
_WIDE = 60  # items of a record or a list
_DEEP = 6
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_ELSEWHERE = re.compile(r"(?:/[^\s/'\"<>:,;()\[\]]+)+|\b[0-9a-f]{8,}\b|\b\d+\.\d+\.\d+\b")  # paths, hashes, versions
_WEIGHTS = np.cos(0.37 * np.arange(_MOST) + 1)
_LATER = ("lens_modes",)  # fields since digests were stored: as of a scene that does not say them they are not there
_SHARES = tuple(0.5 + (0.618034 * (j + 1)) % 1 for j in range(_WIDE))


class Digest(NamedTuple):
    """Of a value: a hash of what is exact, the same without digits in its words, and one number of all numbers.

    A relative change of one number or array within the value is about that change of ``number``.
    """

    exact: int
    wordless: int
    number: float


class Digester:
    """Digests of values; those of records that do not change are made once."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Any, Digest]] = {}  # with the record, so that its place in memory stays its own

    def of(self, value: Any, deep: int = 0) -> Digest:
        """The digest of any value: numbers, texts, arrays, and what holds such.

        >>> one, other = (Digester().of({"at": np.array(at), "is": "ok"}) for at in ([1.0, 2.0], [2.0, 1.0]))
        >>> one.exact == other.exact, abs(one.number - other.number) > 0.1
        (True, True)
        """
        if value is None or isinstance(value, bool | int | np.bool_ | np.integer):
            return _exactly(repr(value if value is None else int(value)))
        if isinstance(value, float | np.floating | mpmath.mpf):
            return _number(float(value))
        if isinstance(value, str):
            return _text(value.value if isinstance(value, enum.Enum) else value)
        if isinstance(value, np.ndarray):
            return self._array(value, deep)
        if deep > _DEEP or callable(value):
            return _exactly(type(value).__name__)
        known = self._known.get(id(value))
        if known is not None:
            return known[1]
        made = self._held(value, deep)
        if _is_frozen(value):
            self._known[id(value)] = value, made
        return made

    def _held(self, value: Any, deep: int) -> Digest:
        """Of what holds other values."""
        if isinstance(value, dict):
            return self._each(type(value).__name__, [x for pair in islice(value.items(), _WIDE) for x in pair], deep)
        if isinstance(value, set | frozenset):
            return self._each("set", sorted(value, key=repr), deep)
        if isinstance(value, tuple | list):
            if len(value) > 1 and all(type(x) is float for x in value):
                return _floats(np.array(value))
            return self._each(type(value).__name__, value, deep)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            names = [each.name for each in dataclasses.fields(value)]
        elif isinstance(value, pydantic.BaseModel):
            fields = type(value).model_fields
            names = [name for name in fields if name not in _LATER or getattr(value, name) != fields[name].default]
        elif sparse.issparse(value):
            value = value.tocsr()
            names = ["shape", "data", "indices", "indptr"]
        else:
            return _exactly(type(value).__name__)
        return self._each(type(value).__name__, [getattr(value, name, None) for name in names], deep)

    def _each(self, name: str, values: Any, deep: int) -> Digest:
        return together(f"{name} {len(values)}", (self.of(each, deep + 1) for each in values[:_WIDE]))

    def _array(self, values: np.ndarray, deep: int) -> Digest:
        kind = values.dtype.kind
        if kind == "c":
            values, kind = np.stack([values.real, values.imag]), "f"
        if kind == "f":
            return _floats(values)
        if kind in "iub":
            shown = _some(values)
            return _exactly(f"{values.shape}", np.ascontiguousarray(shown, np.int64).tobytes())
        return self._each(f"array {values.shape}", values.ravel()[:_WIDE].tolist(), deep)


def together(name: str, parts: Any) -> Digest:
    """One digest of several, by their order."""
    exact = wordless = zlib.crc32(name.encode())
    total = 0.0
    for share, part in zip(_SHARES, parts, strict=False):
        exact = zlib.crc32(part.exact.to_bytes(4, "big"), exact)
        wordless = zlib.crc32(part.wordless.to_bytes(4, "big"), wordless)
        total += share * part.number
    return Digest(exact, wordless, total)


def _is_frozen(value: Any) -> bool:
    if isinstance(value, pydantic.BaseModel):
        return bool(type(value).model_config.get("frozen"))
    return dataclasses.is_dataclass(value) and value.__dataclass_params__.frozen


def _exactly(text: str, more: bytes = b"") -> Digest:
    mark = zlib.crc32(more, zlib.crc32(text.encode()))
    return Digest(mark, mark, 0.0)


def _text(text: str) -> Digest:
    """Without what another folder or another edition of the program changes."""
    bare = _ELSEWHERE.sub("#", text)
    return Digest(zlib.crc32(bare.encode()), zlib.crc32(_NUMBER.sub("#", bare).encode()), 0.0)


def _number(value: float) -> Digest:
    if not math.isfinite(value):
        return _exactly(str(value))
    size = abs(value)
    return _FLOAT._replace(number=math.asinh(size / _SMALL) + value / (size + _SMALL))


_FLOAT = _exactly("float")


def _some(values: np.ndarray) -> np.ndarray:
    """Those of an array, or so many of them, evenly spread, as are looked at."""
    flat = values.ravel()
    return flat if flat.size <= _MOST else flat[:: -(-flat.size // _MOST)]


def _floats(values: np.ndarray) -> Digest:
    shown = _some(values).astype(float)
    known = np.isfinite(shown)
    if not known.all():
        form = _exactly(f"{values.shape}", np.nan_to_num(shown[~known], nan=0.0, posinf=1.0, neginf=-1.0).tobytes())
        shown, weights = shown[known], _WEIGHTS[: shown.size][known]
    else:
        form, weights = _exactly(f"{values.shape}"), _WEIGHTS[: shown.size]
    size = float(np.abs(shown).sum())
    return form._replace(number=math.asinh(size / _SMALL) + 3 * float(weights @ shown) / (size + _SMALL))


NOTHING = together("way", ())
