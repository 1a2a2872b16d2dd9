"""The modules that a recipe runs, copied with what they import of this project; NumPy alone is left."""

from __future__ import annotations

import ast
import hashlib
import re
import sys
from pathlib import Path

import validation
from scenes import InvalidInput

FRONT = "validation.recipe.front"
_ROOTS = ("scenes", "imaging", "planner", "measure", "validation")
_OURS = re.compile(rf"^(\s*from )({'|'.join(_ROOTS)})(?=[. ])", re.MULTILINE)
_MAY = {"numpy", *sys.stdlib_module_names}


def sources() -> dict[str, str]:
    """Text of each module that the front imports, by name, the front first.

    Raises
    ------
    InvalidInput
        If one needs more than NumPy.
    """
    found, left = {}, [FRONT]
    while left:
        name = left.pop()
        if name in found:
            continue
        found[name] = _file(name).read_text(encoding="utf-8")
        for other in _imported(found[name]):
            if other.partition(".")[0] in _ROOTS:
                left.append(other)
            elif other.partition(".")[0] not in _MAY:
                raise InvalidInput(f"a recipe's modules must need NumPy alone, got {other} in {name}")
    return found


def _file(name: str) -> Path:
    return Path(str(validation.__file__)).parents[1].joinpath(*name.split(".")).with_suffix(".py")


def _imported(text: str) -> list[str]:
    """Modules that are imported where a module is run: not those that only annotations name."""
    found = []
    for node in ast.parse(text).body:
        if isinstance(node, ast.Import):
            found += [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            inside = [f"{node.module}.{each.name}" for each in node.names]
            found += [name if _file(name).is_file() else node.module for name in inside]
    return found


def copied(folder: Path) -> tuple[str, list[str]]:
    """Write the modules into a folder, each below a package of their own, and the front beside it.

    Returns
    -------
    str, list of str
        The package's name, a digest of all of them, so that recipes of different versions can be loaded into one
        program; and the files.
    """
    texts = sources()
    digest = hashlib.sha256("".join(f"{name}\n{texts[name]}" for name in sorted(texts)).encode()).hexdigest()
    package, files = f"recipe_code_{digest[:12]}", []
    for name, text in texts.items():
        inside = "recipe.py" if name == FRONT else f"{package}/{name.replace('.', '/')}.py"
        (folder / inside).parent.mkdir(parents=True, exist_ok=True)
        (folder / inside).write_text(_OURS.sub(rf"\g<1>{package}.\g<2>", text), encoding="utf-8")
        files.append(inside)
    return package, files
