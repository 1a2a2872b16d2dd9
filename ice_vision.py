"""Whether Python finds this project's packages by their names, and not what stands beside a script."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path


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


def _file(name: str) -> str | None:
    """The file that is loaded, or would be, by that name; None where it is not known."""
    if name in sys.modules:
        return getattr(sys.modules[name], "__file__", None)
    spec = find_spec(name)
    return spec and spec.origin
