"""A document of tables, lists, numbers and text as TOML: what `tomllib` reads, it writes."""

from __future__ import annotations

import json
import math
import re
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml(document: dict[str, Any]) -> str:
    """The text of a document.

    Parameters
    ----------
    document : dict
        Of str, bool, int, float, lists and dicts; what is None is left out.

    Examples
    --------
    >>> print(toml({"units": "mm", "camera": {"width": 8, "aim": [0.0, 1.5]}, "settings": [{"sensor": [30, 90]}]}))
    units = "mm"
    <BLANKLINE>
    [camera]
    width = 8
    aim = [0.0, 1.5]
    <BLANKLINE>
    [[settings]]
    sensor = [30, 90]
    <BLANKLINE>
    """
    told = {key: value for key, value in document.items() if value is not None}
    plain = "\n".join(_row(key, value) for key, value in told.items() if not _is_table(value))
    parts = [plain] if plain else []
    for key, value in told.items():
        if _is_table(value):
            head, each = (f"[{_key(key)}]", [value]) if isinstance(value, dict) else (f"[[{_key(key)}]]", value)
            parts += ["\n".join([head, *(_row(*row) for row in table.items() if row[1] is not None)]) for table in each]
    return "\n\n".join(parts) + "\n"


def _row(key: str, value: Any) -> str:
    return f"{_key(key)} = {_value(value)}"


def _is_table(value: Any) -> bool:
    many = isinstance(value, list) and bool(value) and all(isinstance(each, dict) for each in value)
    return isinstance(value, dict) or many


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _text(name)


def _text(text: str) -> str:
    """A basic string; TOML forbids the control character 0x7f, which JSON does not escape."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    if isinstance(value, int | float):
        return repr(value)
    raise TypeError(f"{type(value).__name__} has no place in a TOML document")
