"""What is written as TOML is read back as it was."""

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scenes
from scenes.files.door import read_toml
from scenes.files.written import edited

TEXT = st.text(st.characters(exclude_categories=("Cs",)), max_size=12)
PLAIN = st.one_of(TEXT, st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False))
VALUES = st.recursive(
    PLAIN, lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(TEXT, inner, max_size=3))
)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.dictionaries(TEXT, VALUES, max_size=5), st.dictionaries(TEXT, VALUES, max_size=5))
def test_any_document_comes_back(before, document):
    """Made anew, and from any other."""
    anew = edited("", before)
    assert tomllib.loads(anew) == before
    assert tomllib.loads(edited(anew, document)) == document


@pytest.mark.parametrize("name", scenes.names())
def test_bundled_scenes_come_back_as_they_are(name):
    """To the letter where nothing changes; with their comments where a number does."""
    text, document = scenes.find(name).read_text("utf-8"), read_toml(scenes.find(name))
    assert edited(text, document) == text
    assert tomllib.loads(edited("", document)) == document
    document["camera"]["distance"] = 1234.5
    document["settings"] = [{"sensor": [12.5, 3.0], "light": [1.0, 2.0]}]
    changed = edited(text, document)
    assert tomllib.loads(changed) == document
    comments = [line for line in text.split("[[settings]]")[0].splitlines() if line.startswith("#")]
    assert [line for line in changed.splitlines() if line.startswith("#")][: len(comments)] == comments


def test_nothing_is_left_out_and_other_things_are_refused():
    assert tomllib.loads(edited("", {"a": None, "b": {"c": None, "d": [{"e": None, "f": 1}]}})) == {
        "b": {"d": [{"f": 1}]}
    }
    assert tomllib.loads(edited("a = 1\nb = true\nc = 1.0\n", {"a": 1.0, "b": 1})) == {"a": 1.0, "b": 1}
    with pytest.raises(TypeError, match="set has no place in a TOML document"):
        edited("", {"a": {1, 2}})


@pytest.mark.parametrize(
    ("text", "value", "written"),
    [
        ("a = 1", True, "a = true"),
        ("a = true", 1, "a = 1"),
        ("a = 1", 1.0, "a = 1.0"),
        ("a = 1.0", 1, "a = 1"),
        ("a = 1 # one", 1, "a = 1 # one"),
        ("a = [1, 2] # two", [1, 2], "a = [1, 2] # two"),
        ("a = [1, 2] # two", [1, 3], "a = [1, 3]"),
    ],
)
def test_numbers_and_truths_that_are_equal_are_told_apart(text, value, written):
    """1, 1.0 and true are; what is as it was keeps its comment."""
    assert edited(text + "\n", {"a": value}).splitlines()[0].startswith(written)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_lists_of_tables_may_grow_and_shrink(count):
    before = "[[a]] # first\nb = 1 # one\n[[a]]\nb = 2 # two\n"
    wanted = {"a": [{"b": 1 + k} for k in range(count)]}
    assert tomllib.loads(edited(before, wanted)) == wanted
    assert (edited(before, wanted) == before) == (count == 2)
