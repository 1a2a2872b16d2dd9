"""Which functions of the packages each unit test calls, and what it costs: whom ``make mutants`` asks about a slip.

A map file holds it by test file with the file's hash, so that only what changed is run again. As a pytest plugin it
writes what the tests of one run call.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
_RESULT = "REACHED"  # names the file that the plugin writes
_found: dict[str, dict[str, Any]] = {}


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Note every function called by a test and by the fixtures made for it."""
    codes: set[Any] = set()

    def note(frame: Any, event: str, _: Any) -> None:
        if event == "call":
            codes.add(frame.f_code)

    began = time.process_time()
    threading.setprofile(note)
    sys.setprofile(note)
    yield
    sys.setprofile(None)
    threading.setprofile(None)  # type: ignore[arg-type]
    places = ((Path(code.co_filename), code.co_qualname.replace(".<locals>", "")) for code in codes)
    names = {f"{path.relative_to(ROOT)}:{name}" for path, name in places if path.is_relative_to(ROOT)}
    ours = sorted(name for name in names if not name.startswith("tests") and "<module>" not in name)
    _found[item.nodeid] = {"seconds": round(time.process_time() - began, 2), "calls": ours}


def pytest_sessionfinish() -> None:
    """Write what was noted."""
    if _RESULT in os.environ:
        Path(os.environ[_RESULT]).write_text(json.dumps(_found), encoding="utf-8")


def reached(kept: Path, files: list[Path]) -> dict[str, dict[str, Any]]:
    """By test: processor seconds, and the functions called as ``file:qualified name``; what ``kept`` knows is kept."""
    known = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    every: dict[str, dict[str, Any]] = {}
    for path in files:
        name, mark = str(path.relative_to(ROOT)), hashlib.sha256(path.read_bytes()).hexdigest()
        if known.get(name, {}).get("hash") != mark:
            known[name] = {"hash": mark, "tests": _noted(name, kept.with_suffix(".part"))}
            kept.write_text(json.dumps(known), encoding="utf-8")
        every |= known[name]["tests"]
    return every


def _noted(test_file: str, result: Path) -> dict[str, Any]:
    environment = {**os.environ, _RESULT: str(result.absolute()), "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.proofs.reach", test_file]
    result.unlink(missing_ok=True)
    subprocess.run(command, cwd=ROOT, env=environment, capture_output=True)
    return json.loads(result.read_text(encoding="utf-8"))


def function(text: str, line: int) -> str:
    """The qualified name of the function or class around a line; empty outside of them.

    >>> [function("class A:\\n    b = 1\\n    def f(self):\\n        return 1\\nx = 2\\n", n) for n in (2, 3, 4, 5)]
    ['A', 'A.f', 'A.f', '']
    """
    name, nodes = "", ast.parse(text).body
    while nodes:
        inner = next((node for node in nodes if isinstance(node, _NAMED) and _spans(node, line)), None)
        if inner is None:
            return name
        name, nodes = f"{name}.{inner.name}".lstrip("."), inner.body
    return name


_NAMED = (ast.FunctionDef, ast.ClassDef)


def _spans(node: ast.FunctionDef | ast.ClassDef, line: int) -> bool:
    first = min([node.lineno, *(each.lineno for each in node.decorator_list)])
    return first <= line <= (node.end_lineno or node.lineno)
