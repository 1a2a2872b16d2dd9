"""Slips that a good engineer makes, as `make mutants` plants them beside cosmic-ray's changes of signs and numbers.

Each is found in the text of a module, outside of comments and docstrings, and changes one place of it: the wrong axis,
degrees for radians, any for all, height for width, the light for the sensor, the other end of two, a variance for its
root, one degree of freedom, a transpose, another key.

>>> text = "x = np.radians(a.sum(axis=0))"
>>> [(slip, text[a:b], new) for slip in SLIPS for a, b, new in places(slip, text)]
[('axis', 'axis=0', 'axis=1'), ('degrees', 'np.radians', ''), ('other', 'radians', 'degrees')]
"""

from __future__ import annotations

import io
import re
import tokenize
from collections.abc import Callable, Iterator

_OTHER = (
    ("any", "all"), ("min", "max"), ("argmin", "argmax"), ("minimum", "maximum"), ("radians", "degrees"),
    ("sin", "cos"), ("floor", "ceil"), ("width", "height"), ("rows", "columns"), ("sensor", "light"),
    ("polar_deg", "azimuth_deg"), ("plus", "minus"), ("lower", "upper"), ("low", "high"), ("start", "stop"),
    ("sigma", "sigma_image"), ("value", "value_image"), ("predicted", "propagated"), ("bias", "predicted_bias"),
)  # fmt: skip
_SWAP = {one: other for pair in _OTHER for one, other in (pair, pair[::-1])}
_REDUCED = "sum|mean|max|min|all|any|argmin|argmax|std|var|prod|cumsum|argsort|sort"
_AXES = {"0": "1", "1": "0", "-1": "-2", "-2": "-1"}

Place = tuple[int, int, str]  # from, to, and what stands there instead


def _axis(text: str) -> Iterator[Place]:
    for found in re.finditer(rf"\baxis=(-?\d)|\.(?:{_REDUCED})\((-?\d)\)", text):
        number = 1 if found[1] else 2
        if found[number] in _AXES:
            whole, at = found[0], found.start(number) - found.start()
            yield found.start(), found.end(), whole[:at] + _AXES[found[number]] + whole[at + len(found[number]) :]


def _degrees(text: str) -> Iterator[Place]:
    for found in re.finditer(r"\b(?:np|math)\.(?:radians|degrees|deg2rad|rad2deg)(?=\()", text):
        yield found.start(), found.end(), ""


def _root(text: str) -> Iterator[Place]:
    for found in re.finditer(r"\b(?:np|math)\.sqrt(?=\()| ?\*\* ?(?:2|0\.5)\b(?!\.)", text):
        yield found.start(), found.end(), ""


def _other(text: str) -> Iterator[Place]:
    for found in re.finditer(r"(?<=\.)[a-z_]+\b|\b(?:min|max|any|all)(?=\()", text):
        if found[0] in _SWAP:
            yield found.start(), found.end(), _SWAP[found[0]]


def _end(text: str) -> Iterator[Place]:
    ends = {"[0]": "[-1]", "[-1]": "[0]", "[1]": "[0]", "[..., 0]": "[..., 1]", "[..., 1]": "[..., 0]"}
    for found in re.finditer(r"(?<=[\w\])])\[(?:\.\.\., )?-?[01]\]", text):
        if found[0] in ends:
            yield found.start(), found.end(), ends[found[0]]


def _freedom(text: str) -> Iterator[Place]:
    for found in re.finditer(r"ddof=1|(?<=\w) - 1\b(?![.\w])", text):
        yield found.start(), found.end(), "ddof=0" if found[0] == "ddof=1" else ""


def _transposed(text: str) -> Iterator[Place]:
    for found in re.finditer(r"(?<=[\w\])])\.T\b", text):
        yield found.start(), found.end(), ""


def _key(text: str) -> Iterator[Place]:
    found = list(re.finditer(r"(?<=\w\[)\"\w+\"(?=\])", text))
    names = list(dict.fromkeys(each[0] for each in found))
    for each in found:
        if len(names) > 1:
            yield each.start(), each.end(), names[(names.index(each[0]) + 1) % len(names)]


SLIPS: dict[str, Callable[[str], Iterator[Place]]] = {
    "axis": _axis, "degrees": _degrees, "root": _root, "other": _other, "end": _end, "freedom": _freedom,
    "transposed": _transposed, "key": _key,
}  # fmt: skip


def places(slip: str, text: str) -> list[Place]:
    """Where a kind of slip can be made in a module."""
    silent = _silent(text)
    return [place for place in SLIPS[slip](text) if not any(a <= place[0] < b for a, b in silent)]


def slipped(slip: str, text: str, number: int) -> str:
    """The text with the slip at the place of that number."""
    start, end, new = places(slip, text)[number]
    return text[:start] + new + text[end:]


def _silent(text: str) -> list[tuple[int, int]]:
    """Comments and strings of several words or lines: what does nothing."""
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        words = token.type == tokenize.STRING and re.search(r"\s", token.string)
        if token.type == tokenize.COMMENT or words:
            found.append(tuple(starts[row - 1] + column for row, column in (token.start, token.end)))
    return found
