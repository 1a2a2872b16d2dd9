"""How this project's packages are found and loaded: by their names, not what stands beside a script, and when asked
for."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any


def check(beside: str, *names: str) -> None:
    """See that each name is that of the package beside the one whose file asks.

    Raises
    ------
    ImportError
        If it is another file's, named in one line with the package's own.
    """
    for name in names:
        package, found = Path(beside).parents[1] / name / "__init__.py", _file(name)
        if found is not None and Path(found).resolve() != package.resolve():
            raise ImportError(
                f"{name} must be {package}, got {found}, which stands before it on Python's path: rename it"
            )


def later(package: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """A package's ``__getattr__`` and ``__dir__``, for names that are loaded from their modules when asked for."""

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f"{package}.{homes[name]}"), name)

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *homes})

    return load, names


def _file(name: str) -> str | None:
    """The file that is loaded, or would be, by that name; None where it is not known."""
    if name in sys.modules:
        return getattr(sys.modules[name], "__file__", None)
    spec = find_spec(name)
    return spec and spec.origin
