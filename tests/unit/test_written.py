"""What is written as TOML is read back as it was."""

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scenes
from scenes.files.door import read_toml
from scenes.files.written import toml

TEXT = st.text(st.characters(exclude_categories=("Cs",)), max_size=12)
PLAIN = st.one_of(TEXT, st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False))
VALUES = st.recursive(
    PLAIN, lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(TEXT, inner, max_size=3))
)


@settings(max_examples=200, deadline=None)
@given(st.dictionaries(TEXT, VALUES, max_size=5))
def test_any_document_comes_back(document):
    assert tomllib.loads(toml(document)) == document


@pytest.mark.parametrize("name", scenes.names())
def test_bundled_scenes_come_back(name):
    document = read_toml(scenes.find(name))
    assert tomllib.loads(toml(document)) == document


def test_nothing_is_left_out_and_other_things_are_refused():
    assert tomllib.loads(toml({"a": None, "b": {"c": None, "d": [{"e": None, "f": 1}]}})) == {"b": {"d": [{"f": 1}]}}
    with pytest.raises(TypeError, match="set has no place in a TOML document"):
        toml({"a": {1, 2}})
