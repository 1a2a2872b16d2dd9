"""A scene with some of its keys said anew, checked as a file is."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from scenes.cameras.data_sheet import not_derived
from scenes.errors import InvalidInput, describe
from scenes.numbers import steps_of
from scenes.uncertain import taken_out

if TYPE_CHECKING:
    from scenes.scene import Scene

_KEY = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*|\[\d{1,6}\])*")


def changed(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """The scene that `Scene.with_` makes; errors as of that."""
    document: Any = scene
    for key, value in changes.items():
        if not _KEY.fullmatch(key):
            raise InvalidInput(f"key must be one as camera.blur_px or lights[1].distance, got {key!r}")
        document = _said(document, steps_of(key), value, key)
    document = _table(document)
    document["camera"] = _camera(scene, document["camera"])
    document["uncertain"] = _uncertain(scene, document)
    try:
        return type(scene).model_validate(document)
    except ValidationError as error:
        raise InvalidInput(describe(error)) from None


def _table(part: Any) -> Any:
    """A part's own keys as its file has them; what is no part as it is."""
    if not isinstance(part, BaseModel):
        return part
    return {type(part).model_fields[name].alias or name: getattr(part, name) for name in part.model_fields_set}


def _inner(at: Any, name: str) -> Any:
    """What a key says, or its default."""
    return at.get(name) if isinstance(at, dict) else getattr(at, "several_lights" if name == "lights" else name, None)


def _said(at: Any, steps: list[str | int], value: Any, key: str) -> Any:
    """What stands there, with another value at the end of the steps."""
    if not steps:
        return _merged(at, value)
    step = steps[0]
    if isinstance(step, str):
        table = _table(at) if isinstance(at, BaseModel | dict) else {}
        return table | {step: _said(_inner(at, step), steps[1:], value, key)}
    if not isinstance(at, list | tuple) or step >= len(at):
        raise InvalidInput(f"{key} must be one of what the scene has, got none of number {step}")
    return [*at[:step], _said(at[step], steps[1:], value, key), *at[step + 1 :]]


def _merged(at: Any, value: Any) -> Any:
    """A table changes the keys that it has, of a part of the same kind; all else takes the part's place."""
    if not isinstance(value, Mapping) or not isinstance(at, BaseModel | dict):
        return value
    if value.get("kind", _inner(at, "kind")) != _inner(at, "kind"):
        return dict(value)
    return _table(at) | {name: _merged(_inner(at, name), inner) for name, inner in value.items()}


def _camera(scene: Scene, camera: Any) -> Any:
    """Its table, without what follows anew from its data sheets."""
    after, before = _table(camera), _table(scene.camera)
    if not isinstance(after, dict):
        return after
    return not_derived(after, {name for name, value in after.items() if before.get(name) is not value})


def _uncertain(scene: Scene, document: dict[str, Any]) -> Any:
    """How well numbers are known stays as it is, but where a number comes with its own uncertainty."""
    given = document.get("uncertain", ())
    if given is not scene.uncertain:
        return given
    try:
        anew = [each.key for each in taken_out(document | {"uncertain": ()})["uncertain"]]
    except ValueError as error:
        raise InvalidInput(str(error)) from None
    return tuple(each for each in given if each.key not in anew)
