"""What is public says its types: every argument and what comes back, of functions and of classes' own methods."""

import inspect

import pytest

import measure
import planner
import planner.uncertainty
import render
import scenes
import validation


def functions(package):
    """Public functions of a package, and the public methods that its classes define themselves."""
    for name in package.__all__:
        found = getattr(package, name)
        if inspect.isclass(found):
            own = {key: getattr(value, "fget", None) or getattr(value, "__func__", value)
                   for key, value in vars(found).items() if key[0] != "_"}  # fmt: skip
            yield from ((f"{name}.{key}", value) for key, value in own.items() if inspect.isfunction(value))
        elif inspect.isfunction(found):
            yield name, found


def unsaid(found):
    """Arguments without a type, and "return"."""
    arguments = [name for name in inspect.signature(found).parameters if name not in ("self", "cls")]
    return [name for name in (*arguments, "return") if name not in found.__annotations__]


@pytest.mark.parametrize("package", [scenes, planner, planner.uncertainty, render, measure, validation])
def test_public_signatures_are_complete(package):
    assert {name: missing for name, found in functions(package) if (missing := unsaid(found))} == {}


def test_a_missing_type_is_noticed():
    """Negative control."""

    def half(x, y: int = 1):
        return x / 2

    assert unsaid(half) == ["x", "return"]
