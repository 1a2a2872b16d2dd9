"""A notebook run anew, with what its cells show: the documentation's.

``python -m validation.report.executed docs/notebook.ipynb`` runs it from top to bottom and writes it back.
"""

from __future__ import annotations

import ast
import contextlib
import io
import itertools
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def run(notebook: dict[str, Any], change: Callable[[str], str] = str) -> dict[str, Any]:
    """The same notebook (nbformat 4) with the outputs that its code cells have now.

    Parameters
    ----------
    notebook : dict
        As read from its file.
    change : callable
        What a cell's source is changed by before it is run, to try it with less; the source stays as it is.
    """
    names: dict[str, Any] = {}
    numbers = itertools.count(1)
    cells = [
        cell if cell["cell_type"] != "code" else _executed(cell, next(numbers), change, names)
        for cell in notebook["cells"]
    ]
    return {**notebook, "cells": cells}


def write(path: Path) -> None:
    """Run a notebook's file and write it back; files of this project are named as from its root."""
    text = json.dumps(run(json.loads(path.read_text(encoding="utf-8"))), indent=1, ensure_ascii=False)
    path.write_text(text.replace(f"{ROOT}/", "") + "\n", encoding="utf-8")


def _executed(cell: dict[str, Any], number: int, change: Callable[[str], str], names: dict[str, Any]) -> dict[str, Any]:
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        found = _value(change("".join(cell["source"])), names)
    outputs = []
    if told.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": _lines(told.getvalue())})
    if found is not None:
        about = {"output_type": "execute_result", "execution_count": number, "metadata": {}}
        outputs.append(about | {"data": _shown(found)})
    return {**cell, "execution_count": number, "outputs": outputs}


def _value(source: str, names: dict[str, Any]) -> Any:
    """Run a cell; what its last line is worth, None where it is no expression."""
    tree, last = ast.parse(source), None
    if tree.body and isinstance(shown := tree.body[-1], ast.Expr):
        tree.body.pop()
        last = ast.Expression(shown.value)
    exec(compile(tree, "<cell>", "exec"), names)
    return None if last is None else eval(compile(last, "<cell>", "eval"), names)


def _shown(found: Any) -> dict[str, list[str]]:
    """A value by kind of media: text, and HTML where it has that."""
    drawn = getattr(found, "_repr_html_", None)
    return {"text/plain": _lines(repr(found))} | ({"text/html": _lines(drawn())} if drawn else {})


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        write(Path(name))
