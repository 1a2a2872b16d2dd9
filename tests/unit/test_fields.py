"""What records that are read from outside allow of their fields: kinds, bounds and defaults.

Those of a scene are in ``docs/scene.schema.json`` (``test_reference.py``), the others stored:
``python -m tests.unit.test_fields`` stores them anew after a change that was wanted (``make reference``).
"""

import functools
import importlib
import json
import math
import pkgutil
from pathlib import Path
from typing import Annotated

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from tests.regression.stored import read, write
from validation.batch import facts

PACKAGES = "scenes", "imaging", "planner", "measure", "render", "validation"
ROOT = Path(__file__).parents[2]
STORED, SCENE = ROOT / "tests" / "regression" / "fields.json", ROOT / "docs" / "scene.schema.json"
CONFIG = "extra", "strict", "frozen", "allow_inf_nan"
BOUNDS = {  # with which error what is beyond is refused, and which way that is
    "minimum": ("greater_than_equal", -1), "exclusiveMinimum": ("greater_than", -1),
    "maximum": ("less_than_equal", 1), "exclusiveMaximum": ("less_than", 1), "maxLength": ("string_too_long", 1),
}  # fmt: skip


@functools.cache
def models():
    """The records of all packages by full name."""
    for package in map(importlib.import_module, PACKAGES):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    every = {f"{each.__module__}.{each.__qualname__}": each for each in below(BaseModel)}
    return {name: every[name] for name in sorted(every) if name.split(".")[0] in PACKAGES}


def below(model):
    for each in model.__subclasses__():
        yield each
        yield from below(each)


def of_scenes():
    """The schema of a scene and of each record in it, by the record's name without its module."""
    whole = json.loads(SCENE.read_text())
    return {"Scene": whole, **whole["$defs"]}


def bare(schema):
    """A schema without its words, and without the records that it names."""
    if isinstance(schema, list):
        return [bare(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    return {key: bare(each) for key, each in schema.items() if key not in ("$defs", "description", "title")}


def allowed():
    """What each record that is no part of a scene allows, and each document in a run file."""
    others = {name: model for name, model in models().items() if not is_in_a_scene(name)}
    config = {name: {key: model.model_config.get(key) for key in CONFIG} for name, model in others.items()}
    records = {name: {"config": config[name], **bare(model.model_json_schema())} for name, model in others.items()}
    documents = {f"{facts.__name__}.{kind}": bare(each.json_schema()) for kind, each in facts._KINDS.items()}
    return records | documents


def is_in_a_scene(name):
    return name.split(".")[0] == "scenes" and name.split(".")[-1] in of_scenes()


def test_they_are_those_that_were_stored():
    found = json.loads(json.dumps(allowed()))
    assert {name: found.get(name) for name in read(STORED)} == read(STORED)
    assert found.keys() == read(STORED).keys()


def bounds(schema):
    """The limits of a number or a text, or of each of several kinds of it."""
    for each in [schema, *schema.get("anyOf", ())]:
        if each.get("type") in ("number", "integer", "string"):
            yield from ((key, each[key], each["type"]) for key in BOUNDS if key in each)


@functools.cache
def limits():
    """Every bound of a field by record, as it is stored or in the page of the scene format."""
    said = {name: of_scenes()[name.split(".")[-1]] if is_in_a_scene(name) else read(STORED)[name] for name in models()}
    fields = [(name, *field) for name, schema in said.items() for field in schema.get("properties", {}).items()]
    return [(name, field, *bound) for name, field, schema in fields for bound in bounds(schema)]


def beside(key, bound, kind):
    """The last value that a bound takes, and the first one that it refuses."""
    way = BOUNDS[key][1]
    if key == "maxLength":
        return "x" * bound, "x" * (bound + 1)
    within, beyond = (
        (bound - way, bound + way)
        if kind == "integer"
        else (math.nextafter(bound, -way * math.inf), math.nextafter(bound, way * math.inf))
    )
    return (within, bound) if key.startswith("exclusive") else (bound, beyond)


def refusals(model, field, value):
    """Kinds of error with which a value is refused in a field."""
    fields = {info.alias or key: info for key, info in model.model_fields.items()}
    try:
        TypeAdapter(Annotated[fields[field].annotation, "field", *fields[field].metadata]).validate_python(value)
    except ValidationError as error:
        return {each["type"] for each in error.errors()}
    return set()


@pytest.mark.parametrize("key", BOUNDS)
def test_what_is_at_a_bound_is_taken_and_one_beyond_refused(key):
    chosen = [each for each in limits() if each[2] == key]
    assert chosen
    for name, field, _, bound, kind in chosen:
        at, beyond = beside(key, bound, kind)
        assert BOUNDS[key][0] not in refusals(models()[name], field, at), (name, field)
        assert BOUNDS[key][0] in refusals(models()[name], field, beyond), (name, field)


if __name__ == "__main__":
    write(STORED, allowed())
