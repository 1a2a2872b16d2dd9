"""What a run file says of two runs that differ, and of images that failed."""

import pytest

from validation.batch import store


@pytest.mark.parametrize(
    ("there", "here", "said"),
    [
        ({"a": 1, "b": {"c": 2}}, {"a": 1, "b": {"c": 3}}, ["b.c is 2, not 3"]),
        ({"a": [1, 2]}, {"a": [1, 3]}, ["a[1] is 2, not 3"]),
        ({"a": [1, 2]}, {"a": [1]}, ["a is [1, 2], not [1]"]),
        ({"a": [1, 2]}, {"a": "12"}, ['a is [1, 2], not "12"']),
        ({"a": "12"}, {"a": [1, 2]}, ['a is "12", not [1, 2]']),
        ({"a": 5}, {"a": [5]}, ["a is 5, not [5]"]),
        ({"a": {"b": 1}}, {"a": 1}, ['a is {"b": 1}, not 1']),
        ({"a": 1}, {"b": 1}, ["a is 1, not null", "b is null, not 1"]),
        ({"a": [{"b": 1}, {"b": 2}]}, {"a": [{"b": 1}, {"b": 4}]}, ["a[1].b is 2, not 4"]),
        ({"a": [1, 2]}, {"a": [1, 2]}, []),
    ],
)
def test_differences_name_the_key_and_both_values(there, here, said):
    assert list(store._differences(there, here)) == said


def test_a_long_value_is_cut():
    """At 40 characters: 37 and three dots."""
    assert store._short("x" * 38) == '"' + 38 * "x" + '"'
    assert store._short("x" * 39) == '"' + 36 * "x" + "..."


def test_images_that_failed_alike_one_after_another_are_one_row():
    failed = {7: "short", 2: "short", 3: "short", 4: "clutter", 5: "clutter", 9: "clutter"}
    assert list(store._runs(failed)) == [(2, 2, "short"), (4, 2, "clutter"), (7, 1, "short"), (9, 1, "clutter")]
