"""The numbers that a module holds outside of what it does: thresholds, sizes, tables, defaults of private names.

Those of each file by name, as JSON: constants (upper case) of the module and of its classes by value, defaults of
private functions and private records as they are written (public ones: ``tests/unit/test_defaults.py``). Texts are left
out, and what is not the same on every machine.
"""

from __future__ import annotations

import ast
import dataclasses
import importlib
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pydantic

from tests.regression.stored import told

ROOT = Path(__file__).parents[1]
PACKAGES = "scenes", "imaging", "planner", "measure", "render", "validation"
_CONSTANT = re.compile(r"_?[A-Z][A-Z0-9_]*")
_MACHINE = re.compile(r"\bos\.|\bsys\.")  # in the expression of what another machine may hold
_EMPTY = re.compile(r"(OrderedDict|dict|list|set|deque)\(\)|\{\}|\[\]")  # an expression of what is filled while it runs
_MOST = 300  # numbers of an array that are stored one by one
_REL = 1e-12  # of a number, or of the largest of its array, where some cancel; measured: 2e-16


def files() -> list[str]:
    """The modules of the product."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    return [str(path.relative_to(ROOT)) for path in paths if path.name != "__main__.py"]


def constants(file: str) -> dict[str, Any]:
    """The numbers of one module by name, of what it does not import."""
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    module = importlib.import_module(file.removesuffix(".py").removesuffix("/__init__").replace("/", "."))
    values = {name: numbers(value) for name, value in _assigned(tree.body, module)}
    values |= {name: _written(value) for name, value in _defaults(tree.body)}
    return {name: value for name, value in values.items() if holds_number(value)}


def _assigned(nodes: list[ast.stmt], owner: Any, before: str = "") -> Iterator[tuple[str, Any]]:
    """Names of constants in a module or class, and their values."""
    for node in nodes:
        if isinstance(node, ast.ClassDef):
            yield from _assigned(node.body, getattr(owner, node.name), f"{before}{node.name}.")
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]
        text = ast.unparse(node.value)
        for name in names if not (_MACHINE.search(text) or _EMPTY.fullmatch(text)) else ():
            if _CONSTANT.fullmatch(name) and hasattr(owner, name):
                yield f"{before}{name}", getattr(owner, name)


def _defaults(nodes: list[ast.stmt], before: str = "", hidden: bool = False) -> Iterator[tuple[str, ast.expr]]:
    """Defaults of private functions, methods and records, or of what is in such."""
    for node in nodes:
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            continue
        name, private = f"{before}{node.name}", hidden or node.name.startswith("_")
        if isinstance(node, ast.ClassDef):
            yield from _defaults(node.body, f"{name}.", private)
            fields = [each for each in node.body if isinstance(each, ast.AnnAssign)] if private else []
            yield from ((f"{name}.{ast.unparse(each.target)}", each.value) for each in fields if each.value)
        elif private:
            given = node.args
            last = [*given.posonlyargs, *given.args][::-1]
            pairs = [
                *zip(last, given.defaults[::-1], strict=False),
                *zip(given.kwonlyargs, given.kw_defaults, strict=True),
            ]
            yield from ((f"{name}({each.arg})", value) for each, value in pairs if value is not None)


def _written(value: ast.expr) -> Any:
    """The numbers of an expression that says its value."""
    try:
        return numbers(ast.literal_eval(value))
    except ValueError:
        return None


def numbers(value: Any) -> Any:
    """The numbers in a value, everything else as None.

    >>> numbers({"a": (1, True, "text", 1j), 2: np.array([0.5, np.inf])})
    {'a': [1, True, None, [0.0, 1.0]], '2': {'shape': [2], 'values': [0.5, 'inf']}}
    """
    if isinstance(value, bool | int | np.bool_ | np.integer):
        return bool(value) if isinstance(value, bool | np.bool_) else int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else str(value)
    if isinstance(value, complex):
        return [value.real, value.imag]
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, dict):
        return {str(key): numbers(each) for key, each in value.items()}
    if isinstance(value, tuple | list):
        return [numbers(each) for each in value]
    if isinstance(value, set | frozenset):
        return [numbers(each) for each in sorted(value, key=repr)]
    return _record(value)


def _array(values: np.ndarray) -> Any:
    if values.dtype.kind not in "fiubc" or values.size > _MOST:
        return told(values)
    return {"shape": list(values.shape), "values": [numbers(each.item()) for each in values.ravel()]}


def _record(value: Any) -> Any:
    if isinstance(value, type):
        return None
    if dataclasses.is_dataclass(value):
        return {each.name: numbers(getattr(value, each.name)) for each in dataclasses.fields(value)}
    if isinstance(value, pydantic.BaseModel):
        return {name: numbers(getattr(value, name)) for name in type(value).model_fields}
    return None


def holds_number(value: Any) -> bool:
    """Whether there is a number in what ``numbers`` tells.

    >>> [holds_number(numbers(each)) for each in ("a", ("a", {"b": None}), [(0,)], {"b": float("inf")}, {3: "c"})]
    [False, False, True, True, False]
    """
    if isinstance(value, dict | list):
        return any(map(holds_number, value.values() if isinstance(value, dict) else value))
    return value is not None


def changes(stored: dict[str, Any], found: dict[str, Any]) -> list[str]:
    """What differs between the constants of one module, a line each.

    >>> changes({"_A": [1.0, 2.0], "_B": 3}, {"_A": [1.0, 2.1], "_C": True})
    ['_A: [1.0, 2.0] was stored, is [1.0, 2.1]', '_B: 3 was stored, is None', '_C: None was stored, is True']
    >>> changes({"_A": 0.1}, {"_A": 0.1 + 1e-16}), changes({"_A": 1}, {"_A": True})
    ([], ['_A: 1 was stored, is True'])
    """
    return [
        f"{name}: {stored.get(name)} was stored, is {found.get(name)}"
        for name in dict.fromkeys([*stored, *found])
        if not _alike(stored.get(name), found.get(name))
    ]


def _alike(one: Any, other: Any, size: float = 0.0) -> bool:
    if isinstance(one, dict) and isinstance(other, dict):
        size = max((abs(each) for each in one.get("values") or () if isinstance(each, float)), default=0.0)
        return one.keys() == other.keys() and all(_alike(one[key], other[key], size) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(_alike(*pair, size) for pair in zip(one, other, strict=True))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_REL, abs_tol=_REL * size)
    return type(one) is type(other) and one == other
