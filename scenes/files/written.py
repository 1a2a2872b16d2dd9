"""A TOML document's text with other content: comments and order stay where nothing else is said."""

from __future__ import annotations

from collections.abc import MutableMapping
from typing import Any

import tomlkit


def edited(text: str, document: dict[str, Any]) -> str:
    """The text of a document, made from that of another.

    Parameters
    ----------
    text : str
        TOML; empty to begin anew.
    document : dict
        What it is to say, of str, bool, int, float, lists and dicts; what is None is left out.

    Raises
    ------
    TypeError
        If something else is in it.

    Examples
    --------
    >>> print(edited("units = 'mm' # of all\\n[camera]\\nwidth = 8\\n", {"units": "mm", "camera": {"width": 9}}))
    units = 'mm' # of all
    [camera]
    width = 9
    <BLANKLINE>
    """
    whole = tomlkit.parse(text)
    _say(whole, document)
    return tomlkit.dumps(whole)


def _say(table: MutableMapping[str, Any], wanted: dict[str, Any]) -> None:
    """Make a table say what is wanted, changing no more than that takes."""
    told = {key: _told(value) for key, value in wanted.items() if value is not None}
    for key in [key for key in table if key not in told]:
        del table[key]
    for key, value in told.items():
        old = table.get(key)
        if isinstance(old, MutableMapping) and isinstance(value, dict):
            _say(old, value)
        elif isinstance(old, list) and _tables(old) and _tables(value) and len(old) == len(value):
            for one, other in zip(old, value, strict=True):
                _say(one, other)
        elif key not in table or type(_plain(old)) is not type(value) or _plain(old) != value:
            table[key] = value


def _told(value: Any) -> Any:
    """The value without what is None in it."""
    if isinstance(value, dict):
        return {key: _told(each) for key, each in value.items() if each is not None}
    if isinstance(value, list | tuple):
        return [_told(each) for each in value]
    if isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"{type(value).__name__} has no place in a TOML document")


def _plain(value: Any) -> Any:
    return value.unwrap() if hasattr(value, "unwrap") else value


def _tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, MutableMapping) for each in value)
