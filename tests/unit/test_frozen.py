"""Values do not change once they are made: every dataclass is frozen, but for those that collect.

Records of arrays that are looked up by what they are say ``eq=False``: arrays are neither compared nor hashed.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COLLECTING = {"validation/batch/job.py", "validation/cost/goal.py"}


def thawed(text):
    """Names of the dataclasses that are not frozen."""
    found = []
    for node in ast.walk(ast.parse(text)):
        for made in getattr(node, "decorator_list", ()):
            called = made.func if isinstance(made, ast.Call) else made
            keywords = {k.arg: ast.unparse(k.value) for k in getattr(made, "keywords", ())}
            if ast.unparse(called).endswith("dataclass") and keywords.get("frozen") != "True":
                found.append(node.name)
    return found


@pytest.mark.parametrize("package", ["scenes", "imaging", "planner", "render", "measure", "validation"])
def test_dataclasses_are_frozen(package):
    for path in (ROOT / package).rglob("*.py"):
        names = thawed(path.read_text(encoding="utf-8"))
        assert not names or str(path.relative_to(ROOT)) in COLLECTING, f"{path}: {names}"


@pytest.mark.parametrize("package", ["scenes", "imaging", "planner", "render", "measure", "validation"])
def test_what_is_said_of_equality_is_that_there_is_none(package):
    """``eq=True`` is what a dataclass has anyway: who says something means the other."""
    for path in (ROOT / package).rglob("*.py"):
        assert "eq=True" not in path.read_text(encoding="utf-8").replace(" ", ""), path


def test_it_would_be_seen():
    text = "@dataclass\nclass A: ...\n@dataclass(eq=False)\nclass B: ...\n@dataclass(frozen=True)\nclass C: ...\n"
    assert thawed(text + "@dataclasses.dataclass(frozen=False)\nclass D: ...\n") == ["A", "B", "D"]
