"""python -m tests.margins [arguments of pytest]: which comparisons within a factor 5 of their limits do not say why?

Runs the tests with the recorder (`recorder.py`) and lists the worst margin of each such place. A comment that begins
with "margin:", on the statement or just above it, explains a place: what stands for another reason than a tolerance (a
bound that holds by its kind, chance of so many standard errors, the order of two numbers) says so. It exits 1 if any
is left.
`python -m tests.margins --read FILE` lists what a run has recorded, `--explained` those with a reason too.
"""

import argparse
import ast
import functools
import json
import subprocess
import sys
import tempfile
from pathlib import Path

_FACTOR = 5
_MARK = "margin:"
_ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--read", type=Path, help="list what a run has recorded there")
    parser.add_argument("--explained", action="store_true", help="list what is explained too")
    chosen, arguments = parser.parse_known_args()
    if chosen.read:
        return listed(chosen.read, chosen.explained)
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory, "margins.jsonl")
        command = ["-m", "pytest", "-q", "-p", "tests.margins.recorder", "--margins", str(file), *arguments]
        done = subprocess.run([sys.executable, *command], cwd=_ROOT)
        file.touch()
        return listed(file, chosen.explained) or done.returncode


def listed(file: Path, explained: bool) -> int:
    """Print the places whose margin is small; 1 if one of them has no reason."""
    worst: dict = {}
    for one in map(json.loads, file.read_text().splitlines()):
        first, last = _statement(one["file"], one["line"])
        place = one["file"], first, last
        if one["ratio"] > worst.get(place, one)["ratio"] or place not in worst:
            worst[place] = one
    near = {place: one for place, one in sorted(worst.items()) if one["ratio"] > 1 / _FACTOR}
    reasons = {place: _reason(*place) for place in near}
    for place, one in near.items():
        if explained or not reasons[place]:
            print(f"{place[0]}:{place[1]}: {one['value']:.6g} against {one['limit']:.6g} ({one['ratio']:.2f})", end=" ")
            print(reasons[place] or one["test"].partition("::")[2])
    bare = sum(not reason for reason in reasons.values())
    print(
        f"{len(worst)} places compare numbers, {len(near)} within a factor {_FACTOR} of the limit, {bare} unexplained"
    )
    return int(bare > 0)


@functools.cache
def _statements(file: str) -> tuple[list[str], list[tuple[int, int]]]:
    """Lines of a file, and first and last line of each simple statement and of each compound one's head."""
    text = (_ROOT / file).read_text()
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.stmt)]
    ends = [node.body[0].lineno - 1 if getattr(node, "body", None) else node.end_lineno for node in nodes]
    return text.splitlines(), [(node.lineno, end) for node, end in zip(nodes, ends, strict=True)]


def _statement(file: str, line: int) -> tuple[int, int]:
    around = [place for place in _statements(file)[1] if place[0] <= line <= place[1]]
    return min(around, key=lambda place: place[1] - place[0], default=(line, line))


def _reason(file: str, first: int, last: int) -> str:
    """What the comments on a statement, or just above it, say of its margin."""
    lines = _statements(file)[0]
    above = first - 1
    while above and lines[above - 1].lstrip().startswith("#"):
        above -= 1
    before = " ".join(line.strip("# ") for line in lines[above : first - 1]).partition(_MARK)[2]
    beside = (line.partition(_MARK)[2] for line in lines[first - 1 : last])
    return " ".join(part.strip() for part in (before, *beside) if part)


if __name__ == "__main__":
    sys.exit(main())
