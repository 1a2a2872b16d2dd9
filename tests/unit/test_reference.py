"""The reference page and the schema of the scene format are those of the models."""

import json
import tomllib
from pathlib import Path

import pytest

import scenes
from scenes import reference
from scenes.load import BUNDLED

DOCS = Path(__file__).parents[2] / "docs"


def test_page_and_schema_are_up_to_date():
    """`python -m scenes.reference docs` writes them anew."""
    assert (DOCS / "scene-format.md").read_text() == reference.page()
    assert json.loads((DOCS / "scene.schema.json").read_text()) == reference.schema()


def test_every_key_has_a_meaning():
    """Said of itself, or in the text above its table."""
    whole = reference.schema()
    for name, model in {"": whole, **whole["$defs"]}.items():
        text = model.get("description", "")
        for key, facts in model.get("properties", {}).items():
            known = "description" in facts or f"``{key}``" in text or name in ("Corner", "Centre", "Task", "Locator")
            assert known, (name, key)


def test_the_schema_knows_uncertain_numbers():
    """A table in the place of a number, also in a lens, a position or one of several kinds of light; nowhere else."""
    models = reference.schema()["$defs"]
    table = {"$ref": "#/$defs/UncertainValue"}
    for model, key in (("Camera", "focal_px"), ("Lens", "distortion"), ("Ring", "inner_radius"), ("Noise", "gain")):
        assert table in models[model]["properties"][key]["anyOf"], (model, key)
    assert table in models["Camera"]["properties"]["look_at"]["prefixItems"][0]["anyOf"]
    assert models["UncertainValue"]["required"] == ["value"]
    assert "UncertainValue" not in json.dumps([models["Block"], models["Locator"], models["Task"]])


def unknown(document, schema, whole, path=""):
    """Keys of a document that the schema does not know, and required ones that the document lacks."""
    if isinstance(document, dict) and "oneOf" in schema:
        schema = next((part for part in schema["oneOf"] if "$ref" in part and is_meant(document, part, whole)), schema)
    if "$ref" in schema:
        schema = whole["$defs"][schema["$ref"].rsplit("/", 1)[-1]]
    if isinstance(document, dict) and "properties" in schema:
        yield from (f"{path}.{key}" for key in set(document) - set(schema["properties"]))
        yield from (f"{path}.{key} (missing)" for key in set(schema.get("required", ())) - set(document))
        for key in set(document) & set(schema["properties"]):
            yield from unknown(document[key], schema["properties"][key], whole, f"{path}.{key}")
    if isinstance(document, list) and isinstance(schema.get("items"), dict):
        for i, item in enumerate(document):
            yield from unknown(item, schema["items"], whole, f"{path}[{i}]")


def is_meant(document, part, whole):
    """Whether a table is of the kind that a reference stands for, by its name or as what is meant without one."""
    model = whole["$defs"][part["$ref"].rsplit("/", 1)[-1]]
    kind = model["properties"].get("kind", {})
    return "const" in kind and document.get("kind", kind.get("default")) == kind["const"]


@pytest.mark.parametrize("name", scenes.names())
def test_bundled_scenes_keep_the_schema(name):
    whole = reference.schema()
    document = tomllib.loads((BUNDLED / f"{name}.toml").read_text())
    assert list(unknown(document, whole, whole)) == []
    assert list(unknown({**document, "camera": {"zoom": 2}}, whole, whole))


def test_limits_are_those_of_a_value_or_of_a_list_s_first():
    """Of alternatives each; what is said twice is said once."""
    number = {"minimum": 1, "maximum": 2.5}
    assert reference._limits(number) == ">= 1, <= 2.5"
    assert reference._limits({"prefixItems": [number, {"minimum": 7}]}) == ">= 1, <= 2.5"
    assert reference._limits({"items": {"exclusiveMinimum": 0}}) == "> 0"
    several = {"anyOf": [{"maximum": 4}, {"prefixItems": [{"exclusiveMaximum": 5}, {"maximum": 6}]}, {"maximum": 4}]}
    assert reference._limits(several) == "<= 4, < 5"
    assert reference._limits({"maxLength": 9}) == "at most 9 characters"
    assert reference._limits({}) == ""
