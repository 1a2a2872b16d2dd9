"""What functions gave, as it is stored, compared and made: of each only what agrees wherever it was run."""

from __future__ import annotations

import functools
import heapq
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.regression.digest import NOTHING, Digest
from tests.regression.returns import CALLS, Call
from tests.regression.stored import CLOSED, RENDERED, SEARCHED

STORED = Path(__file__).with_name("returns.json")
APART = Path(__file__).with_name("apart.json")  # what processors give otherwise, which is not stored
_TOLERANCES = CLOSED, SEARCHED, RENDERED  # of the number of a digest, about a relative change; the rest is not compared
_PART = 0.2  # of a tolerance that runs may differ by which were made to store: others differ more
_NO = "-"
_WORTH = 4.0, 1.0, 0.5  # of the first case that shows a function, and of two others in which it gives something else
_CASES = 8  # that are kept of a function
_SECONDS = 38.0  # processor time of all cases
_STEP = 0.03  # seconds of a test beside its case
_WAYS = "what it was given or gave", "what it held on the way"

Kept = dict[str, dict[str, list[str]]]  # by function and case: a line for each of `_WAYS`
Entry = tuple[str, str, str]  # function, case, one of `_WAYS`


@functools.cache
def read(stored: Path) -> Kept:
    """What is stored, by function and case."""
    return json.loads(stored.read_text(encoding="utf-8")) if stored.exists() else {}


@functools.cache
def by_case(stored: Path) -> dict[str, dict[str, list[str]]]:
    """The same by case and function; cases in the order of their names."""
    found: dict[str, dict[str, list[str]]] = {}
    for function, cases in read(stored).items():
        for case, lines in cases.items():
            found.setdefault(case, {})[function] = lines
    return dict(sorted(found.items()))


def different(stored: dict[str, list[str]], found: dict[str, list[Call]]) -> list[str]:
    """Which functions gave something else than is stored, a line each; functions that are new are none."""
    return [line for function, lines in stored.items() for line in _of_function(function, lines, found.get(function))]


def _of_function(function: str, lines: list[str], found: list[Call] | None) -> Iterator[str]:
    if found is None:
        yield f"{function}: is not called any more (python -m tests.regression.test_returns stores anew)"
        return
    for line, part, way in zip(lines, zip(*found, strict=True), _WAYS, strict=True):
        for number, (said, digest) in zip(CALLS, _pairs(line, part), strict=False):
            if said != digest:
                yield f"{function}: call {number}, {way}: stored {said}, got {digest}"
                return  # what follows, follows from it


def _pairs(line: str, digests: tuple[Digest, ...]) -> Iterator[tuple[str, str]]:
    """What is stored of each call, and what is found, the same text where it is within the tolerance."""
    if line == _NO:
        return
    hashed, tolerance, *calls = line.split()
    for i in range(max(len(calls), len(digests))):
        said = calls[i] if i < len(calls) else "no call"
        if i >= len(digests):
            yield said, "no call"
            continue
        told = _told(digests[i], hashed, tolerance)
        yield said, said if said != "no call" and _alike(said, told, tolerance) else told


def _told(digest: Digest, hashed: str, tolerance: str) -> str:
    mark = {"exact": digest.exact, "wordless": digest.wordless}.get(hashed)
    return f"{_NO if mark is None else f'{mark:08x}'}:{_NO if tolerance == _NO else f'{digest.number:.7f}'.rstrip('0')}"


def _alike(said: str, told: str, tolerance: str) -> bool:
    one, other = said.split(":"), told.split(":")
    if one[0] != other[0] or tolerance == _NO:
        return one[0] == other[0]
    return abs(float(one[1]) - float(other[1])) <= float(tolerance)


def entries(stored: Path) -> set[Entry]:
    """What is told apart in a file of ``APART``'s kind."""
    return {(f, case, way) for f, case, way in json.loads(stored.read_text(encoding="utf-8"))}


def otherwise(stored: Kept, runs: dict[str, dict[str, list[Call]]]) -> set[Entry]:
    """What runs by case and function on one more processor give otherwise than is stored."""
    return {
        (function, case, way)
        for function, cases in stored.items()
        for case, lines in cases.items()
        for k, way in enumerate(_WAYS)
        if list(_of_function(function, _alone(lines, k), runs.get(case, {}).get(function)))
    }


def _alone(lines: list[str], k: int) -> list[str]:
    return [each if i == k else _NO for i, each in enumerate(lines)]


def loosened(stored: Kept, apart: set[Entry]) -> Kept:
    """The same without the entries that are told apart."""
    found: Kept = {}
    for function, cases in stored.items():
        for case, lines in cases.items():
            left = [_NO if (function, case, way) in apart else each for each, way in zip(lines, _WAYS, strict=True)]
            if left != [_NO] * len(left):
                found.setdefault(function, {})[case] = left
    return found


def still(found: Kept, before: Kept, changed: set[Entry]) -> Kept:
    """What is found; what has not changed as it was stored before, no more exact than other processors made it."""
    return {
        function: {
            case: [
                each if (function, case, way) in changed else old
                for each, old, way in zip(lines, before.get(function, {}).get(case, lines), _WAYS, strict=True)
            ]
            for case, lines in cases.items()
        }
        for function, cases in found.items()
    }


def line(runs: list[list[Digest]]) -> str:
    """What is stored of a function's calls in a case, of the same in several runs; `_NO` where these do not agree."""
    if len({len(run) for run in runs}) > 1 or all(each == NOTHING for each in runs[0]):
        return _NO
    hashed = next((way for way in ("exact", "wordless") if _agree(runs, way)), _NO)
    away = max((abs(each.number - first.number) for run in runs for first, each in zip(runs[0], run, strict=True)))
    tolerance = next((f"{most:g}" for most in _TOLERANCES if away <= _PART * most), _NO)
    if hashed == "exact" and tolerance != f"{CLOSED:g}":
        hashed = "wordless" if _agree(runs, "wordless") else _NO  # another machine's last digit may be another
    if hashed == tolerance == _NO:
        return _NO
    return " ".join([hashed, tolerance, *(_told(each, hashed, tolerance) for each in runs[0])])


def _agree(runs: list[list[Digest]], way: str) -> bool:
    return len({tuple(getattr(each, way) for each in run) for run in runs}) == 1


def kept(runs: list[dict[str, dict[str, list[Call]]]]) -> Kept:
    """What is stored of runs, each by case and function."""
    found: Kept = {}
    for case, functions in runs[0].items():
        for function in functions:
            calls = [run.get(case, {}).get(function) for run in runs]
            if all(calls):
                lines = [line([[call[way] for call in some] for some in calls]) for way in range(len(_WAYS))]
                there = found.setdefault(function, {})
                if len(there) < _CASES and lines != [_NO] * len(_WAYS) and lines not in there.values():
                    there[case] = lines
    return {function: cases for function, cases in sorted(found.items()) if cases}


def chosen(seconds: dict[str, float], gave: dict[str, dict[str, Any]], limit: float = _SECONDS) -> list[str]:
    """Cases that show the most functions in a time, each function giving something else in up to three of them.

    Always the case that shows the most in a second; what it shows can only get less when others are taken.
    """
    known: dict[str, set[Any]] = {}

    def news(case: str) -> dict[str, float]:
        seen = ((function, what, known.get(function, set())) for function, what in gave[case].items())
        return {name: _WORTH[len(had)] for name, what, had in seen if len(had) < len(_WORTH) and what not in had}

    def worth(case: str) -> float:
        return -sum(news(case).values()) / (seconds[case] + _STEP)

    spent, cases = 0.0, []
    heap = [(worth(case), case) for case in seconds]
    heapq.heapify(heap)
    while heap and heap[0][0] < 0:
        _, best = heapq.heappop(heap)
        now = worth(best)
        if heap and now > heap[0][0]:
            heapq.heappush(heap, (now, best))
        elif now < 0 and spent + seconds[best] <= limit:
            for function in news(best):
                known.setdefault(function, set()).add(gave[best][function])
            cases.append(best)
            spent += seconds[best]
    return cases
