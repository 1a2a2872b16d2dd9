"""Which functions of the packages each test calls, and what it costs: whom ``make mutants`` asks about a slip.

A map file holds a line for each test file, with its hash, so that only what changed is run again: all of it in one
process a core, by this module as a pytest plugin. What a fixture of a module or of all tests calls counts for each test
that takes it. What does not pass on clean code is noted, too: nobody asks it.
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
_WORKERS = os.cpu_count() or 1
_RESULT = "REACHED"  # names the map file that the plugin adds to
_found: dict[str, dict[str, dict[str, Any]]] = {}  # by test file and test
_fixtures: dict[str, set[Any]] = {}  # what was called to make each
_now: list[set[Any]] = []  # what is called by the test that runs


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    """Note every function called by a test and by the fixtures made for it; a file's last test writes them."""
    codes: set[Any] = set()

    def note(frame: Any, event: str, _: Any, add: Any = codes.add) -> None:
        if event == "call":
            add(frame.f_code)

    began = time.process_time()
    _now.append(codes)
    threading.setprofile(note)
    sys.setprofile(note)
    yield
    sys.setprofile(None)
    threading.setprofile(None)  # type: ignore[arg-type]
    _now.pop()
    codes = codes.union(*(_fixtures.get(name, ()) for name in getattr(item, "fixturenames", ())))
    places = ((Path(code.co_filename), code.co_qualname.replace(".<locals>", "")) for code in codes)
    names = {f"{path.relative_to(ROOT)}:{name}" for path, name in places if path.is_relative_to(ROOT)}
    ours = sorted(name for name in names if not name.startswith("tests") and "<module>" not in name)
    kept = _found.setdefault(str(item.path.relative_to(ROOT)), {}).setdefault(item.nodeid, {"passed": True})
    kept |= {"seconds": round(time.process_time() - began, 2), "calls": ours}
    if nextitem is None or nextitem.path != item.path:
        _write(item.path)


@pytest.hookimpl(hookwrapper=True)
def pytest_fixture_setup(fixturedef: Any) -> Iterator[None]:
    """Note what is called to make a fixture: the tests after the first that take it do not call it again."""
    before = set(_now[-1]) if _now else set()
    yield
    if _now and fixturedef.scope != "function":
        _fixtures.setdefault(fixturedef.argname, set()).update(_now[-1] - before)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Note what fails on clean code."""
    if report.failed:
        _found.setdefault(report.nodeid.split("::")[0], {}).setdefault(report.nodeid, {})["passed"] = False


def _write(path: Path) -> None:
    name = str(path.relative_to(ROOT))
    line = json.dumps({"file": name, "hash": _mark(path), "tests": _found[name]}) + "\n"
    with Path(os.environ[_RESULT]).open("ab", buffering=0) as file:  # at once: others add lines, too
        file.write(line.encode())


def _mark(path: Path) -> str:
    """Of a test file and of what it compares with."""
    return hashlib.sha256(b"".join(each.read_bytes() for each in _with_stored(path))).hexdigest()


def _with_stored(path: Path) -> list[Path]:
    stored = path.with_name(path.name.removeprefix("test_")).with_suffix(".json")
    return [path, stored] if stored.exists() else [path]


def reached(kept: Path, files: list[Path]) -> dict[str, dict[str, Any]]:
    """By test that passes: processor seconds, and the functions called as ``file:qualified name``."""
    missing = [path for path in files if not _known(kept).get((str(path.relative_to(ROOT)), _mark(path)))]
    if missing:
        environment = {**os.environ, _RESULT: str(kept.absolute()), "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.proofs.reach"]
        workers = [
            subprocess.Popen(
                [*command, "-m", "not long", *map(str, missing[first::_WORKERS])], cwd=ROOT, env=environment,
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )
            for first in range(min(_WORKERS, len(missing)))
        ]  # fmt: skip
        for worker in workers:
            worker.wait()
    known = _known(kept)
    every: dict[str, dict[str, Any]] = {}
    for path in files:
        every |= known.get((str(path.relative_to(ROOT)), _mark(path)), {})
    return {test: each for test, each in every.items() if each.get("passed") and "calls" in each}


def _known(kept: Path) -> dict[tuple[str, str], dict[str, Any]]:
    """What a map file holds, by test file and its hash."""
    lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
    return {(each["file"], each["hash"]): each["tests"] for each in map(json.loads, lines)}


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
