"""Runs of the stored cases by which it is told what of functions agrees everywhere; by ``test_returns`` as a command.

On Linux on x86_64, where other processors can be taken for this one (``tests.machines``).
``python -m tests.regression.storing CASES OUT [--reversed] [--fast] [--again]`` is one run.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.machines import HASWELL, KERNELS, OLD, SANDY, Machine, libraries
from tests.regression.digest import Digest
from tests.regression.kept import (
    APART,
    STORED,
    Entry,
    Kept,
    by_case,
    chosen,
    entries,
    kept,
    loosened,
    otherwise,
    read,
    still,
)
from tests.regression.returns import PACKAGES, ROOT, recorded

_CLOCKS = "time", "perf_counter", "process_time", "monotonic"
_WORKERS = 2  # runs at a time
_FASTER, _FILES = 7, 20  # clocks of one of the runs, and how many files are open then


@dataclass(frozen=True)
class Way:
    """How a run is made: options of this module, another machine, in an edited copy of the program or not."""

    options: tuple[str, ...] = ()
    machine: Machine | None = None
    is_edited: bool = False


WAYS = (
    Way(),
    Way(("--reversed",)),
    Way(("--fast",), is_edited=True),
    Way(machine=OLD),
    Way(("--reversed",), machine=HASWELL),
    Way(machine=SANDY),
    Way(machine=KERNELS),
    Way(("--again",)),
)


def store(choose: bool) -> None:
    """Store anew what functions give in the cases that are stored, or in those that are chosen anew."""
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(_WORKERS) as executor:
        folder = Path(name)
        cases = sorted(_choice(folder) if choose or not STORED.exists() else by_case(STORED))
        folders = [folder / str(number) for number in range(len(WAYS))]
        runs = list(executor.map(_run, WAYS, [cases] * len(WAYS), folders))
    before = read(STORED)
    found = still(kept(runs), before, otherwise(before, runs[0]))
    _write(loosened(found, entries(APART)))


def loosen() -> None:
    """Leave out, now and whenever is stored, what this processor gives otherwise: where no function has changed."""
    with tempfile.TemporaryDirectory() as name:
        found = otherwise(read(STORED), _run(Way(), sorted(by_case(STORED)), Path(name) / "0"))
    _write_apart(entries(APART) | found)
    _write(loosened(read(STORED), found))


def _write_apart(found: set[Entry]) -> None:
    APART.write_text("[\n" + ",\n".join(map(json.dumps, sorted(found))) + "\n]\n", encoding="utf-8")
    print(f"{len(found)} entries that processors give otherwise: {APART}")


def _write(found: Kept) -> None:
    lines = [f"{json.dumps(function)}: {json.dumps(told)}" for function, told in found.items()]
    STORED.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    print(f"{len(found)} functions in {len({case for cases in found.values() for case in cases})} cases: {STORED}")


def _choice(folder: Path) -> list[str]:
    """Cases, after all were run once."""
    seconds, gave = {}, {}
    for case, spent, calls in _lines(Way(), [], folder / "100"):
        seconds[case] = spent
        gave[case] = {
            f: tuple((e.exact, f"{e.number:.5g}") for call in some for e in call) for f, some in calls.items()
        }
    return chosen(seconds, gave)


def _run(way: Way, cases: list[str], folder: Path) -> dict[str, Any]:
    return {case: calls for case, _, calls in _lines(way, cases, folder)}


def _lines(way: Way, cases: list[str], folder: Path) -> list[tuple[str, float, dict[str, Any]]]:
    """Case, processor seconds and calls, of a run in a process of its own."""
    folder.mkdir()
    root = _edited(folder / "copy") if way.is_edited else ROOT
    environment = {name: value for name, value in os.environ.items() if not name.startswith("OPENBLAS_")}
    if way.machine is not None:
        environment = way.machine.environment(libraries(folder / "mitsuba", way.machine.configuration))
    home = {"HOME": str(folder), "XDG_CACHE_HOME": str(folder / "cache"), "PYTHONPATH": str(root)}
    one = {"OMP_NUM_THREADS": environment.get("OMP_NUM_THREADS", "1"), "PYTHONHASHSEED": folder.name}
    (folder / "cases").write_text(json.dumps(cases), encoding="utf-8")
    command = ["-m", "tests.regression.storing", str(folder / "cases"), str(folder / "out"), *way.options]
    subprocess.run([sys.executable, *command], cwd=root, env=environment | home | one, check=True)
    with (folder / "out").open(encoding="utf-8") as file:
        return [(case, spent, _digests(calls)) for case, spent, calls in map(json.loads, file)]


def _digests(calls: dict[str, Any]) -> dict[str, Any]:
    return {f: [tuple(Digest(*each) for each in call) for call in some] for f, some in calls.items()}


def _edited(folder: Path) -> Path:
    """A copy of what git knows and of what is new, each of the product's files with a comment before and after."""
    asked = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    for name in subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines():
        if not (ROOT / name).exists():
            continue  # taken away, which git does not know yet
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    for path in (path for package in PACKAGES for path in (folder / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        path.write_text(f"# edited\n{text}\n# edited\n", encoding="utf-8")
    return folder


def main() -> None:
    """One run."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--reversed", action="store_true", help="the last case first, on one core")
    parser.add_argument("--fast", action="store_true", help="clocks are faster, other files open, another processor")
    parser.add_argument("--again", action="store_true", help="each was run before: what a process calls once is done")
    asked = parser.parse_args()
    clock = time.process_time
    if asked.fast:
        for name in _CLOCKS:
            setattr(time, name, lambda now=getattr(time, name): _FASTER * now())
        for _ in range(_FILES):
            os.dup(0)
    if asked.reversed:
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:1])
    warnings.simplefilter("error")  # as in tests
    warnings.filterwarnings("ignore", "Implicitly cleaning up", ResourceWarning)  # folders that last as long as it
    from tests.regression.test_numbers import CASES
    from validation.batch import machine

    if asked.fast:
        machine._processor.__code__ = (lambda: ("another", {"sse9"})).__code__

    names = [name for name in json.loads(asked.cases.read_text(encoding="utf-8")) or CASES if name in CASES]
    with asked.out.open("w", encoding="utf-8") as file:
        for name in names[::-1] if asked.reversed else names:
            if asked.again:
                CASES[name][1]()
            began = clock()
            calls = recorded(CASES[name][1])
            file.write(json.dumps([name, clock() - began, calls]) + "\n")


if __name__ == "__main__":
    main()
