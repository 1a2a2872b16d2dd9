"""Values do not change once they are made: every dataclass is frozen, but for those that collect.

Records of arrays say ``eq=False``: arrays are neither compared nor hashed, so such a record is itself alone.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COLLECTING = {"validation/batch/job.py", "validation/cost/goal.py"}


def dataclasses(text):
    """Each dataclass of a module with what its decorator is told."""
    for node in ast.walk(ast.parse(text)):
        for made in getattr(node, "decorator_list", ()):
            called = made.func if isinstance(made, ast.Call) else made
            if ast.unparse(called).endswith("dataclass"):
                yield node, {k.arg: ast.unparse(k.value) for k in getattr(made, "keywords", ())}


def thawed(text):
    """Names of the dataclasses that are not frozen."""
    return [node.name for node, told in dataclasses(text) if told.get("frozen") != "True"]


def compared(text):
    """Names of the dataclasses of arrays that would be compared, or hashed, by them: both end in an error."""
    return [
        node.name
        for node, told in dataclasses(text)
        if told.get("eq") != "False"
        and any("ndarray" in ast.unparse(field.annotation) for field in node.body if isinstance(field, ast.AnnAssign))
    ]


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


@pytest.mark.parametrize("package", ["scenes", "imaging", "planner", "render", "measure", "validation"])
def test_records_of_arrays_are_not_compared(package):
    for path in (ROOT / package).rglob("*.py"):
        assert compared(path.read_text(encoding="utf-8")) == [], path


def test_a_record_of_arrays_that_is_compared_would_be_seen():
    text = "@dataclass(frozen=True{})\nclass A:\n    a: np.ndarray | None\n"
    assert compared(text.format("") + text.format(", eq=False") + text.replace("np.ndarray", "int").format("")) == ["A"]


def test_it_would_be_seen():
    text = "@dataclass\nclass A: ...\n@dataclass(eq=False)\nclass B: ...\n@dataclass(frozen=True)\nclass C: ...\n"
    assert thawed(text + "@dataclasses.dataclass(frozen=False)\nclass D: ...\n") == ["A", "B", "D"]
