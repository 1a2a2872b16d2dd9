"""The scene format as a page for people and as a JSON schema for editors, both made from the models.

    python -m scenes.reference docs

writes ``docs/scene-format.md`` and ``docs/scene.schema.json`` anew.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import sys
import textwrap
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from scenes.cameras.kinds import CAMERAS
from scenes.model import Model
from scenes.numbers import ROOTS
from scenes.scene import Scene

_INTRODUCTION = """# The scene format

A scene is a TOML file of at most 1 MiB. This page is made from the models that check it, by
`python -m scenes.reference docs`; `scene.schema.json` beside it says the same to an editor: begin a scene with
`#:schema path/to/scene.schema.json`, or name it in the editor's settings. `ice new PART.stl` writes a scene to begin
with, `ice show SCENE` lists what a task can name.

Units: `length` is the scene's own unit (its key `units`), image lengths are px with (0, 0) the centre of the first
pixel, brightness is in grey levels. A key without a default has to be given.
"""
_LIMITS = {"minimum": ">=", "maximum": "<=", "exclusiveMinimum": ">", "exclusiveMaximum": "<"}
_FOLLOWING = ("width", "height", "focal_px", "distance")  # of a camera whose data sheets may say them


def schema() -> dict[str, Any]:
    """JSON schema of a scene's file; numbers that may be uncertain may be a table that says how much."""
    found = _documented()
    models = found["$defs"]
    models["UncertainValue"] = {**models["Uncertain"], "required": ["value"], "title": "UncertainValue"}
    for model in _below([found["properties"][root] for root in ROOTS], models):
        model["properties"] = {key: _or_uncertain(facts) for key, facts in model["properties"].items()}
    return found


def _below(parts: list[dict[str, Any]], models: dict[str, Any]) -> list[dict[str, Any]]:
    """The models that a part of a schema names, and those that these name, each once."""
    names: list[str] = []
    while parts:
        new = re.findall(r"#/\$defs/(\w+)", json.dumps(parts))
        new = [name for name in dict.fromkeys(new) if name not in names]
        names += new
        parts = [models[name] for name in new]
    return [models[name] for name in names if "properties" in models[name]]


def _or_uncertain(facts: dict[str, Any]) -> dict[str, Any]:
    """A number, or the numbers of a list, or such a table in its place."""
    table = {"$ref": "#/$defs/UncertainValue"}
    if facts.get("type") == "number":
        outside = {key: facts[key] for key in ("title", "description", "default") if key in facts}
        return {**outside, "anyOf": [{key: value for key, value in facts.items() if key not in outside}, table]}
    if "anyOf" in facts:
        parts = [_or_uncertain(part) if part.get("type") == "array" else part for part in facts["anyOf"]]
        return {**facts, "anyOf": [*parts, table] if any(part.get("type") == "number" for part in parts) else parts}
    if isinstance(facts.get("items"), dict):
        return {**facts, "items": _or_uncertain(facts["items"])}
    if "prefixItems" in facts:
        return {**facts, "prefixItems": [_or_uncertain(item) for item in facts["prefixItems"]]}
    return facts


def _documented() -> dict[str, Any]:
    """The schema as the page tells it: every number plain."""
    found = Scene.model_json_schema()
    found["title"] = "Scene"
    found["required"] = [key for key in found["required"] if key != "name"]
    known = {"": Scene, **_models()}
    for name, model in {"": found, **found["$defs"]}.items():
        _plain(model)
        for key, meaning in (_meanings(known[name]) if name in known else {}).items():
            model["properties"][key]["description"] = meaning
    for kind in CAMERAS:
        camera = found["$defs"][CAMERAS[kind].__name__]
        camera["required"] = [key for key in camera.get("required", ()) if key not in _FOLLOWING]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **found}


def _meanings(model: type[Model]) -> dict[str, str]:
    """What the strings below a model's keys say of them; of its bases' too."""
    found = {}
    for each in reversed(model.__mro__):
        if issubclass(each, Model):
            found |= _said_below(each)
    return {field.alias or name: found[name] for name, field in model.model_fields.items() if name in found}


@cache
def _said_below(model: type[Model]) -> dict[str, str]:
    """The strings below the keys of this class alone."""
    parsed = ast.parse(textwrap.dedent(inspect.getsource(model)))
    written = next(part for part in parsed.body if isinstance(part, ast.ClassDef))
    return {
        key.target.id: inspect.cleandoc(below.value.value)
        for key, below in pairwise(written.body)
        if isinstance(key, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
    }


def _plain(model: dict[str, Any]) -> None:
    """Descriptions on one line each, without examples."""
    if "description" in model:
        model["description"] = " ".join(model["description"].split("\n\n")[0].split())


def page() -> str:
    """The reference page, Markdown."""
    whole = _documented()
    parts = [_INTRODUCTION, _section("", Scene, whole, whole)]
    for name, model in sorted(_models().items()):
        if name in whole["$defs"]:
            parts.append(_section(name, model, whole["$defs"][name], whole))
    return "\n".join(parts)


def _models(model: type[Model] = Model) -> dict[str, type[Model]]:
    """All models by name."""
    return {
        name: found
        for kind in model.__subclasses__()
        if kind.__module__.startswith("scenes.") and kind is not Scene
        for name, found in {kind.__name__: kind, **_models(kind)}.items()
    }


def _section(name: str, model: type[Model], told: dict[str, Any], whole: dict[str, Any]) -> str:
    text = re.split(r"\n\n(?:Raises|Examples)\n", inspect.getdoc(model) or "")[0]
    rows = ["| key | meaning | unit | type | default | limits |", "|---|---|---|---|---|---|"]
    required = told.get("required", ())
    for key, facts in told.get("properties", {}).items():
        meaning, unit = _meaning(facts.get("description", "see above"))
        shown = _shown(facts["default"]) if "default" in facts else "" if key in required else "left out"
        cells = f"`{key}`", meaning, unit, _kind(facts, whole), shown, _limits(facts)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join([f"## {name or 'The whole file'}", "", text.replace("``", "`"), "", *rows, ""])


def _meaning(text: str) -> tuple[str, str]:
    """What a description says, and the unit that it ends with.

    >>> _meaning("Width of the image [px].")
    ('Width of the image.', 'px')
    """
    line = " ".join(text.split()).replace("``", "`")
    found = re.fullmatch(r"(.*?) ?\[([^\]]+)\]\.?", line)
    return (f"{found[1]}.", found[2]) if found else (line, "")


def _shown(default: Any) -> str:
    if isinstance(default, dict) and default:
        return "its defaults"
    return "left out" if default is None or default in ([], {}) else f"`{json.dumps(default)}`"


def _kind(facts: dict[str, Any], whole: dict[str, Any]) -> str:
    """Type of a value in words, models by their name."""
    if "$ref" in facts:
        name = facts["$ref"].rsplit("/", 1)[-1]
        return f"[{name}](#{name.lower()})"
    for several in ("anyOf", "oneOf"):
        if several in facts:
            return " or ".join(dict.fromkeys(_kind(f, whole) for f in facts[several] if f.get("type") != "null"))
    if "enum" in facts or "const" in facts:
        return ", ".join(f"`{json.dumps(value)}`" for value in facts.get("enum", [facts.get("const")]))
    if facts.get("type") == "array":
        inside = facts.get("prefixItems")
        if inside:
            return f"list of {len(inside)}: {', '.join(dict.fromkeys(_kind(item, whole) for item in inside))}"
        return f"list of {_kind(facts['items'], whole)}" if facts.get("items") else "list"
    if facts.get("type") == "object":
        inner = facts.get("additionalProperties")
        return f"table of {_kind(inner, whole)}" if isinstance(inner, dict) else "table"
    return {"integer": "whole number", "string": "text", "boolean": "true or false"}.get(
        facts.get("type", ""), facts.get("type", "pair")
    )


def _limits(facts: dict[str, Any]) -> str:
    """Limits of a value, or of the values of a list."""
    parts = [facts, *facts.get("anyOf", ()), *facts.get("prefixItems", ())[:1], facts.get("items") or {}]
    parts += [item for part in facts.get("anyOf", ()) for item in part.get("prefixItems", ())[:1]]
    found = [
        f"{sign} {part[key]:g}"
        for part in parts
        if isinstance(part, dict)
        for key, sign in _LIMITS.items()
        if key in part
    ]
    longest = [
        f"at most {part['maxLength']} characters" for part in parts if isinstance(part, dict) and "maxLength" in part
    ]
    return ", ".join(dict.fromkeys(found + longest))


def write(folder: Path) -> tuple[Path, Path]:
    """Write page and schema into a folder."""
    folder.mkdir(exist_ok=True)
    texts = {"scene-format.md": page(), "scene.schema.json": json.dumps(schema(), indent=1) + "\n"}
    for name, text in texts.items():
        (folder / name).write_text(text)
    return tuple(folder / name for name in texts)


if __name__ == "__main__":
    print(*write(Path(sys.argv[1] if len(sys.argv) > 1 else "docs")), sep="\n")
