"""The one error that bad input raises, and how pydantic's reports become one line of it."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

_LIMITS = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
    "too_short": ("at least as long as", "min_length"),
    "too_long": ("at most as long as", "max_length"),
}
_KINDS = {
    "finite_number": "a finite number",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a text",
    "tuple_type": "a list",
    "missing": "given",
    "extra_forbidden": "a known key",
    "model_type": "a table of keys",
    "model_attributes_type": "a table of keys",
    "dict_type": "a table of keys",
}


_TAGS = "block", "mesh", "step", "corner", "centre", "side", "statistical", "image", "str", "Where"
KIND = "kind "  # before the name of a registered kind where pydantic says which it took
# both are alternatives of the model, no keys of the file
_MOST = 600  # characters of a message: enough for a path, a key and what was given


class InvalidInput(ValueError):
    """Input that cannot be used. Its text is one line of limited length, "X must be ..., got ..."."""

    def __init__(self, text: str) -> None:
        super().__init__(one_line(text))


def one_line(text: str, most: int = _MOST) -> str:
    """A text that any terminal can show: control characters and broken Unicode escaped, its middle left out if long.

    >>> one_line("a\\nb"), one_line("0123456789" * 9, 20)
    ('a\\\\nb', '012345678 ... 456789')
    """
    if len(text) > most:
        text = f"{text[: most // 2 - 1]} ... {text[len(text) - (most // 2 - 4) :]}"
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in text)
    return shown if len(shown) <= 2 * most else f"{shown[:most]} ..."


def given(value: Any) -> str:
    """What was given, for a message; Python prints no whole number of more than 4,300 digits.

    >>> given("x"), given(10**5000)
    ("'x'", 'a whole number of too many digits')
    """
    try:
        return repr(value)
    except ValueError:
        return "a whole number of too many digits"


def describe(error: ValidationError, *where: int | str) -> str:
    """First problem of a pydantic report as one line "key must be ..., got ..."; ``where`` what was checked stands."""
    problem = error.errors(include_url=False)[0]
    location = (*where, *problem["loc"])
    if problem["type"] == "value_error" and " must " in str(problem["ctx"]["error"]):
        text = str(problem["ctx"]["error"])
        return text if not location or "." in text.split(" must ")[0] else f"{_key(location)}: {text}"
    if problem["type"] == "union_tag_invalid" and problem["ctx"]["tag"].startswith(KIND):
        known, got = (problem["ctx"][name].replace(KIND, "") for name in ("expected_tags", "tag"))
        return f"{_key((*location, 'kind'))} must be one of {known}, got '{got}'"
    return f"{_key(location)} must be {_requirement(problem)}, got {_shown(problem)}"


def _key(location: tuple[int | str, ...]) -> str:
    """("settings", 3, "light") becomes settings[3].light."""
    key = ""
    for part in (part for part in location if part not in _TAGS and not str(part).startswith(KIND)):
        key += f"[{part}]" if isinstance(part, int) else f".{part}" if key else part
    return key or "the scene"


def _requirement(problem: Any) -> str:
    kind, context = problem["type"], problem.get("ctx", {})
    if kind in _LIMITS:
        words, name = _LIMITS[kind]
        return f"{words} {context[name]:g}"
    if kind in ("literal_error", "enum"):
        return f"one of {context['expected']}"
    if kind == "union_tag_invalid":
        known = context["expected_tags"].replace("'", "")
        return f"a known kind ({known})"
    return _KINDS.get(kind, f"valid ({problem['msg']})")


def _shown(problem: Any) -> str:
    if problem["type"] == "missing":
        return "nothing"
    text = given(problem["input"])
    return text if len(text) <= 80 else text[:77] + "..."
