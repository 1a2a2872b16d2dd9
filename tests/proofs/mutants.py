"""``make mutants``: are the tests there that would notice a slip? A sample of them, each judged by the nearest tests.

A mutant is one place of the code changed by one of cosmic-ray's operators (a sign, a comparison, a number, a condition)
or by one of the slips of ``tests.proofs.slips``. Each is made in a copy of the repository and tested there: first the
examples of its own module, the tests that read the code and, where it may have records, those of their fields; then
what the changed function and others of the module gave when it was stored (``tests.regression.test_returns``), the
tests and the stored numbers that call these, the quickest first (``tests.proofs.reach``), then those of the files of
whole commands that speak most of the names that the module defines, and at last the slower tests that call the
function. Killed is what makes one of them fail that passes on clean code, where it is run, too, after some of its file
that came before it (stored numbers are each by itself). What survives is printed with its line: a test is missing, or
the mutant is equivalent.
"""

from __future__ import annotations

import argparse
import ast
import compileall
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import Queue
from typing import Any

from tests.proofs.equivalent import is_equivalent
from tests.proofs.forked import Runner
from tests.proofs.reach import function, reached
from tests.proofs.slips import SLIPS, places, slipped

ROOT = Path(__file__).parents[2]
SOURCES = ("scenes", "imaging", "planner", "measure", "render", "validation")
# tests that read the code
READERS = ["tests/unit/test_frozen.py", "tests/unit/test_defaults.py::test_no_default_changes_unnoticed"]
NUMBERS, HELD = "tests/unit/test_defaults.py::test_no_number_changes_unnoticed", "tests/regression/constants.json"
FIELDS = ["tests/unit/test_fields.py", "tests/unit/test_reference.py::test_page_and_schema_are_up_to_date"]
RETURNS, GAVE = "tests/regression/test_returns.py", "tests/regression/returns.json"
STORED = ("tests/regression/test_documents.py", "tests/regression/test_numbers.py", RETURNS)  # what was said once
UNIT, OTHERS = "tests/unit", ("tests/hard", "tests/system")
_BINARY = ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "Pow_Mul", "Add_Mul")
_COMPARISON = ("Lt_GtE", "Gt_LtE", "LtE_Gt", "GtE_Lt", "Eq_NotEq", "NotEq_Eq")
_OTHERS = (
    "ReplaceUnaryOperator_Delete_USub", "ReplaceUnaryOperator_Delete_Not", "ReplaceAndWithOr", "ReplaceOrWithAnd",
    "NumberReplacer", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ZeroIterationForLoop",
    "ReplaceBreakWithContinue",
)  # fmt: skip
OPERATORS = tuple(
    f"core/{name}"
    for name in (
        *(f"ReplaceBinaryOperator_{pair}" for pair in _BINARY),
        *(f"ReplaceComparisonOperator_{pair}" for pair in _COMPARISON),
        *_OTHERS,
    )
)
_FILES = 3  # test files that a mutant meets after the unit tests
_CALLING_S = 12  # processor seconds, on clean code, of the tests that call the changed function
_OF_MODULE = 3  # stored cases that tell most of a module's functions
_MODULE_S = 3  # of those that call others of the module
_REST_S = 90  # of those that call the changed function and are asked last, of what survived until then
_LIMIT_S = 45  # after which these do not end
_OTHERS_S = 45  # of the files that are asked then
_BEFORE = 20  # tests up to the one that kills, that are asked of clean code
_IMPORTED = 2.0  # what a test file's import of the module counts beside its names
_COMMON = 4  # letters; shorter names say nothing
_RECORDS = re.compile(r"^from (?:pydantic|scenes\.(?:model|ranges)) ", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """One place (its number among those of the operator) of one file."""

    file: str
    operator: str
    place: int


def mutants(root: Path = ROOT, within: tuple[str, ...] = SOURCES) -> list[Mutant]:
    """All of them of some packages, in the order of files and operators."""
    import parso
    from cosmic_ray.ast import ast_nodes
    from cosmic_ray.plugins import get_operator, operator_names

    known, found = set(operator_names()), []
    operators = {name: get_operator(name)() for name in OPERATORS if name in known}
    for file in (each for each in sources(root) if each.startswith(within)):
        nodes = list(ast_nodes(parso.parse((root / file).read_text(encoding="utf-8"))))
        for name, operator in operators.items():
            count = sum(len(list(operator.mutation_positions(node))) for node in nodes)
            found += [Mutant(file, name, place) for place in range(count)]
        text = (root / file).read_text(encoding="utf-8")
        found += [Mutant(file, slip, place) for slip in SLIPS for place in range(len(places(slip, text)))]
    return found


def sources(root: Path = ROOT) -> list[str]:
    """The files that are mutated."""
    each = ([root / name] if name.endswith(".py") else sorted((root / name).rglob("*.py")) for name in SOURCES)
    return [str(path.relative_to(root)) for some in each for path in some if path.name != "__init__.py"]


def calling(
    mutant: Mutant,
    line: int,
    tests: dict[str, dict[str, Any]],
    root: Path = ROOT,
    limits: tuple[float, float] = (_CALLING_S, _MODULE_S),
) -> list[str]:
    """The tests that call the function around a line, then those that call others of the module.

    The quickest first, so many as the time allows. Who takes a kept result calls nothing, hence the others. Not those
    of `telling`.
    """
    name = f"{mutant.file}:{function((root / mutant.file).read_text(encoding='utf-8'), line)}"
    some = {
        t: each["calls"]
        for t, each in tests.items()
        if _file(t) != RETURNS and any(c.startswith(f"{mutant.file}:") for c in each["calls"])
    }
    own = {t for t, calls in some.items() if any(c == name or c.startswith(f"{name}.") for c in calls)}
    chosen: list[str] = []
    for group, seconds in zip((own, some.keys() - own), limits, strict=True):
        spent = 0.0
        for test in sorted(group, key=lambda test: (tests[test]["seconds"], test)):
            spent += tests[test]["seconds"]
            if spent > seconds and (chosen or not seconds):
                break
            chosen.append(test)
    return chosen


def telling(mutant: Mutant, line: int, tests: dict[str, dict[str, Any]], root: Path = ROOT) -> list[str]:
    """The stored cases in which it is told what the function around a line gave, then those of most of its module."""
    stored = json.loads((root / GAVE).read_text("utf-8"))
    name = f"{mutant.file}:{function((root / mutant.file).read_text(encoding='utf-8'), line)}"
    own = [case for key, cases in stored.items() if key == name or key.startswith(f"{name}.") for case in cases]
    module = Counter(case for key, cases in stored.items() if key.startswith(f"{mutant.file}:") for case in cases)
    most = [case for case, _ in module.most_common(_OF_MODULE)]
    first, then = (
        {f"{RETURNS}::test_functions_give_what_was_stored[{case}]" for case in some} & tests.keys()
        for some in (own, most)
    )
    asked, spent = [], 0.0
    for test in (*sorted(first, key=lambda test: tests[test]["seconds"]), *sorted(then - first)):
        spent += tests[test]["seconds"]
        if spent <= _CALLING_S or not asked:
            asked.append(test)
    return asked


def nearest(file: str, root: Path = ROOT, folders: tuple[str, ...] = OTHERS) -> list[str]:
    """The test files that use most of a module.

    Importing the module counts most; of its names each weighs less the more files use it. For a module that no test
    uses, those of the modules that import it.
    """
    tests = {
        path: path.read_text(encoding="utf-8") for name in folders for path in sorted((root / name).glob("test_*.py"))
    }
    score = _score(file, root, tests)
    if not any(score.values()):
        uses = [other for other in sources(root) if _module(file) in (root / other).read_text(encoding="utf-8")]
        every = [_score(other, root, tests) for other in uses]
        score = {path: sum(each[path] for each in every) for path in tests}
    best = sorted((path for path in tests if score[path]), key=lambda path: (-score[path], str(path)))
    return [str(path.relative_to(root)) for path in best[:_FILES]]


def _module(file: str) -> str:
    return file.removesuffix(".py").replace("/", ".")


def _score(file: str, root: Path, tests: dict[Path, str]) -> dict[Path, float]:
    """How much of a module each test file uses."""
    words = {path: set(re.findall(r"\w+", text)) for path, text in tests.items()}
    tree = ast.parse((root / file).read_text(encoding="utf-8"))
    names = {n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.ClassDef)} | {Path(file).stem}
    names = {name for name in names if len(name) >= _COMMON and not name.startswith("__")}
    uses = {name: sum(name in some for some in words.values()) for name in names}
    imported = re.compile(rf"\b{re.escape(_module(file))}\b")
    return {
        path: _IMPORTED * bool(imported.search(text)) + sum(1 / uses[name] for name in names if name in words[path])
        for path, text in tests.items()
    }


def changed(mutant: Mutant, root: Path) -> tuple[str, str]:
    """The mutated file's text and, with file and number, its line; empty where nothing changes."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    before = (root / mutant.file).read_text(encoding="utf-8")
    if mutant.operator in SLIPS:
        after = slipped(mutant.operator, before, mutant.place)
    else:
        after = mutate_code(before, get_operator(mutant.operator)(), mutant.place)
    if after is None or after == before:
        return "", ""
    pairs = zip(before.splitlines(), after.splitlines(), strict=False)
    number, line = next(((n, new) for n, (old, new) in enumerate(pairs, 1) if old != new), (0, ""))
    return after, f"{mutant.file}:{number}: {line.strip()}"


def judged(
    mutant: Mutant, root: Path, runner: Runner, tests: dict[str, dict[str, Any]], is_first: bool = False
) -> tuple[str, str]:
    """ "killed", "survived", "too slow" or "no baseline", and the test that killed, or that fails on clean code, too.

    ``root`` is a copy that nobody else uses.
    """
    path = root / mutant.file
    before, times = path.read_text(encoding="utf-8"), path.stat()
    after, line = changed(mutant, root)
    own = [mutant.file] if ">>> " in before else []
    fields = FIELDS if _RECORDS.search(before) else []
    number = int(line.split(":")[1])
    held = [f"{NUMBERS}[{mutant.file}]"] if mutant.file in json.loads((root / HELD).read_text("utf-8")) else []
    near = together([*own, *READERS, *held, *fields, *_calling(mutant, number, tests, root)])
    others, rest = [], []
    path.write_text(after, encoding="utf-8")
    try:
        code, by = _tested(near, runner, _LIMIT_S)
        if code in _ENDED:
            return "too slow", ""  # a loop that no longer ends, or slow tests: neither killed nor survived
        if not is_first and code in _PASSED:
            others = [test for file in nearest(mutant.file, root) for test in tests if _file(test) == file]
            others = [test for test in others if test not in near]
        if others:
            code, by = _tested(others, runner, _OTHERS_S)
        rest = [] if is_first or code not in (*_PASSED, *_ENDED) else _rest(mutant, number, tests, root, near)
        if rest:
            code, by = _tested(rest, runner, 2 * _REST_S)
    finally:
        path.write_text(before, encoding="utf-8")
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))  # the compiled one is of this text
    if code in (*_PASSED, *_ENDED):
        return "survived", ""
    asked = rest or others or near
    before_it = asked[: asked.index(by) + 1][-_BEFORE:] if by in asked and _file(by) not in STORED else [by]
    again = [each for each in before_it if _file(each) == _file(by)] if by else asked[: 1 if code == _USAGE else None]
    clean, wrong = _tested(again, runner, 2 * _REST_S)
    return ("killed", by) if clean in _PASSED else ("no baseline", wrong)


def _calling(mutant: Mutant, line: int, tests: dict[str, dict[str, Any]], root: Path) -> list[str]:
    """Those that tell of the function first."""
    told = telling(mutant, line, tests, root)
    return [*told, *(each for each in calling(mutant, line, tests, root) if each not in told)]


def together(tests: list[str]) -> list[str]:
    """Tests of one file one after the other, or what is set up for a module is set up again in between.

    >>> together(["b.py::one", "a.py", "b.py::two"])
    ['b.py::one', 'b.py::two', 'a.py']
    """
    files = list(dict.fromkeys(map(_file, tests)))
    return sorted(tests, key=lambda test: files.index(_file(test)))


def _file(test: str) -> str:
    return test.split("::")[0]


def _rest(mutant: Mutant, line: int, tests: dict[str, dict[str, Any]], root: Path, asked: list[str]) -> list[str]:
    """The slower tests that call the changed function."""
    return together([each for each in calling(mutant, line, tests, root, (_REST_S, 0.0)) if each not in asked])


_PASSED = 0, 5  # exit status of pytest; the second: no tests
_USAGE = 4  # exit status where nothing can be run: not even conftest.py is imported
_ENDED = -signal.SIGXCPU, -signal.SIGKILL  # for processor time


def _tested(tests: list[str], runner: Runner, seconds: int) -> tuple[int, str]:
    """Exit status of these tests in a copy, and the one that fails, if it has a name."""
    code, said = runner.run(tests, seconds)
    return code, next(iter(re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", said, re.MULTILINE)), "")


def copies(count: int, folder: Path) -> Queue[tuple[Path, Runner]]:
    """So many copies of what git knows, compiled."""
    names = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    free: Queue[tuple[Path, Runner]] = Queue()
    for number in range(count):
        for name in filter(None, names):
            target = folder / str(number) / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, target)
        root = folder / str(number)
        compileall.compile_dir(root, quiet=2)
        collect = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", "tests"]
        subprocess.run(collect, cwd=root, env={**os.environ, "PYTHONPATH": str(root)}, capture_output=True)  # compiles
        free.put((root, Runner(root)))
    return free


def main() -> None:
    """Print what survives and the share that is killed; exit status 1 if that is below 90 %."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", nargs="+", default=[""], help="What the files' names begin with, such as measure/.")
    parser.add_argument("--log", type=Path, default=Path("runs/mutants.jsonl"), help="What it knows is not done again.")
    parser.add_argument("--again", action="store_true", help="... but for what was not killed.")
    parser.add_argument("--first", action="store_true", help="Only tests that call it: what survives is for --again.")
    asked = parser.parse_args()
    every, began = mutants(within=tuple(asked.only)), time.perf_counter()
    asked.log.parent.mkdir(parents=True, exist_ok=True)
    asked_first = [*(ROOT / name for name in STORED)]
    asked_first += [path for name in (UNIT, *OTHERS) for path in sorted((ROOT / name).glob("test_*.py"))]
    tests = reached(asked.log.with_name("reach.jsonl"), asked_first)
    chosen = sorted(every, key=lambda mutant: _drawn(mutant, asked.seed))[: asked.count]
    known = _known(asked.log)
    tally = dict.fromkeys(("killed", "survived", "too slow", "no baseline", "equivalent", "same"), 0)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(asked.workers) as executor:
        free = copies(asked.workers, Path(folder))

        def one(mutant: Mutant) -> tuple[str, str]:
            (root, runner), since = free.get(), time.perf_counter()
            try:
                line = changed(mutant, root)[1]
                if not line or is_equivalent(mutant.operator, _bare(line)):
                    return "equivalent" if line else "same", line
                if line in known and (known[line] == "killed" or not asked.again):
                    return known[line], line
                outcome, by = judged(mutant, root, runner, tests, asked.first)
                with asked.log.open("a", encoding="utf-8") as log:
                    seconds = round(time.perf_counter() - since)
                    log.write(
                        json.dumps({"line": line, "outcome": outcome, "by": by, "seconds": seconds, **asdict(mutant)})
                        + "\n"
                    )
                return outcome, line
            finally:
                free.put((root, runner))

        for outcome, line in executor.map(one, chosen):
            tally[outcome] += 1
            if outcome in ("survived", "too slow", "no baseline"):
                print(f"{outcome}: {line}", flush=True)
    tried = sum(tally.values()) - tally["same"] - tally["equivalent"]
    print(
        f"{tally['killed']} of {tried} mutants killed, {tally['equivalent']} more are equivalent "
        f"({len(every)} in all) in {time.perf_counter() - began:.0f} s"
    )
    sys.exit(tally["killed"] < 0.9 * tried)


def _drawn(mutant: Mutant, seed: int) -> str:
    """A number by which mutants are drawn: a change of one file leaves the sample of the others as it was."""
    return hashlib.sha256(f"{seed} {mutant}".encode()).hexdigest()


def _bare(line: str) -> str:
    """The file and the line's text, without its number."""
    return re.sub(r":\d+: ", ": ", line, count=1)


def _known(log: Path) -> dict[str, str]:
    """The latest outcome by mutated line; a line that stands elsewhere now is judged anew."""
    if not log.exists():
        return {}
    found = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    return {each["line"]: each["outcome"] for each in found}


if __name__ == "__main__":
    main()
