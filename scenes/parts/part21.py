"""The instances of a STEP file's text (ISO 10303-21), each read when it is asked for."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

_TEXT = r"'(?:[^']|'')*+'"  # possessive, as below: no text is read in two ways, and none twice
_STATEMENT = re.compile(rf"(?:{_TEXT}|[^';])*+;")
_INSTANCE = re.compile(r"\s*#(\d{1,18})\s*=\s*(.*);", re.DOTALL)
_COMMENT = re.compile(r"('[^']*(?:'|\Z))|/\*.*?(?:\*/|\Z)", re.DOTALL)
_KEYWORD = re.compile(r"'[^']*'|([A-Z][A-Z0-9_]*)\s*\(")
_TOKEN = re.compile(
    rf"""\s*(?:(?P<text>{_TEXT})|(?P<reference>\#\d+)|\.(?P<enumeration>[A-Z0-9_]+)\.|(?P<binary>"[0-9A-F]*")
    |(?P<number>[-+]?\d+(?:\.\d*)?(?:[Ee][-+]?\d+)?)|(?P<keyword>!?[A-Z][A-Z0-9_]*)|(?P<mark>[(),$*]))""",
    re.VERBOSE,
)
_ESCAPED = re.compile(r"\\X2\\((?:[0-9A-F]{4})+)\\X0\\|\\X\\([0-9A-F]{2})")
_DEEPEST = 32  # lists within lists


class Reference(int):
    """The number of another instance."""


class Enumeration(str):
    """A word between dots, without them."""

    __slots__ = ()


class Typed(NamedTuple):
    """A value with the name of its type."""

    kind: str
    value: Any


@dataclass(frozen=True, eq=False)
class Instance:
    """Entities of one instance, mostly one: parameters by keyword.

    A parameter is a text, number, `Reference`, `Enumeration`, `Typed`, tuple of such, or None where there is none.
    """

    number: int
    entities: dict[str, tuple[Any, ...]]

    def of(self, *kinds: str) -> tuple[Any, ...] | None:
        """Parameters of the first of some entities that it has."""
        return next((self.entities[kind] for kind in kinds if kind in self.entities), None)


@dataclass(frozen=True, eq=False)
class Part21:
    """A file's instances.

    Attributes
    ----------
    texts : dict of int to str
        What stands behind each number, in the file's order.
    """

    texts: dict[int, str]

    @classmethod
    def of(cls, data: bytes) -> Part21:
        """Of a file's bytes.

        >>> file = Part21.of(b"DATA;\\n#1=FLAT('it''s; so',(#2,.T.),$,1.5);#2=(A(3)B());\\nENDSEC;")
        >>> file[1].entities
        {'FLAT': ("it's; so", (2, 'T'), None, 1.5)}
        >>> [file[number].entities for number in file.numbers("B")], file[7].entities
        ([{'A': (3,), 'B': ()}], {})
        """
        text, texts, at = data.decode("utf-8", "replace"), {}, 0
        if "/*" in text:
            text = _COMMENT.sub(lambda found: found[1] or " ", text)
        while (statement := _STATEMENT.match(text, at)) is not None:
            at = statement.end()
            if (found := _INSTANCE.fullmatch(statement[0])) is not None:
                texts[int(found[1])] = found[2]
        return cls(texts)

    def __getitem__(self, number: int) -> Instance:
        """An instance, without entities where there is none or what stands there cannot be read."""
        try:
            return Instance(number, _Reader(self.texts.get(number, "")).entities())
        except ValueError:
            return Instance(number, {})

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Numbers of all instances in the file's order."""
        return tuple(self.texts)

    def numbers(self, *kinds: str) -> list[int]:
        """Numbers of the instances that have an entity of one of some kinds, in the file's order."""
        found = {number for kind in kinds for number in self._by_kind.get(kind, ())}
        return sorted(found, key=self._place.__getitem__)

    @cached_property
    def _place(self) -> dict[int, int]:
        return {number: place for place, number in enumerate(self.texts)}

    @cached_property
    def _by_kind(self) -> dict[str, list[int]]:
        found = defaultdict(list)
        for number, text in self.texts.items():
            kinds = [text.split("(", 1)[0].strip()] if text[:1] != "(" else _KEYWORD.findall(text)
            for kind in dict.fromkeys(kinds):
                found[kind].append(number)
        return dict(found)


class _Reader:
    """Tokens of one instance's text."""

    def __init__(self, text: str):
        self.text, self.at = text, 0

    def entities(self) -> dict[str, tuple[Any, ...]]:
        kind, value = self._token()
        if kind == "keyword":
            return {value: self._list(0)}
        found = {}
        while (kind, value) == ("mark", "("):
            while (token := self._token()) != ("mark", ")"):
                found[token[1]] = self._list(0)
            kind, value = "end", ""
        return found

    def _list(self, deep: int) -> tuple[Any, ...]:
        if self._token() != ("mark", "("):
            raise ValueError("a list must begin")
        return self._rest(deep)

    def _rest(self, deep: int) -> tuple[Any, ...]:
        """What stands in a list that has begun."""
        if deep > _DEEPEST:
            raise ValueError("too deep")
        found: list[Any] = []
        while (token := self._token()) != ("mark", ")"):
            if token != ("mark", ","):
                found.append(self._value(token, deep))
        return tuple(found)

    def _value(self, token: tuple[str, str], deep: int) -> Any:
        kind, value = token
        if kind == "text":
            return _ESCAPED.sub(_unescaped, value[1:-1].replace("''", "'"))
        if kind == "reference":
            return Reference(value[1:])
        if kind == "number":
            return float(value) if set(value) & set(".eE") else int(value)
        if kind == "enumeration":
            return Enumeration(value)
        if kind == "keyword":
            inside = self._list(deep + 1)
            return Typed(value, inside[0] if len(inside) == 1 else inside)
        return self._rest(deep + 1) if value == "(" else None

    def _token(self) -> tuple[str, str]:
        found = _TOKEN.match(self.text, self.at)
        if found is None or found.lastgroup is None:
            raise ValueError("no token")
        self.at = found.end()
        return found.lastgroup, found[found.lastgroup]


def _unescaped(found: re.Match[str]) -> str:
    """Characters beyond ASCII."""
    return bytes.fromhex(found[1]).decode("utf-16-be", "replace") if found[1] else chr(int(found[2], 16))


def number_at(parameters: tuple[Any, ...], place: int) -> int | None:
    """A reference among parameters, as a number; None where there is none."""
    found = parameters[place] if len(parameters) > place else None
    return int(found) if isinstance(found, Reference) else None


def text_at(parameters: tuple[Any, ...], place: int) -> str:
    found = parameters[place] if len(parameters) > place else None
    return found.strip() if isinstance(found, str) else ""
