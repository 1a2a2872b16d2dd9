"""What every part of a scene is: a frozen, checked record."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PydanticUserError, TypeAdapter, ValidationError

from scenes.errors import InvalidInput, describe, given

_FORBIDDEN = re.compile(r'[\x00-\x1f\x7f/\\:*?"<>|]')  # by some file system


class Model(BaseModel):
    """Frozen, without unknown keys, without NaN or infinity.

    What a key means is said below it, for readers and for `scenes.reference`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values, each checked by itself: quick, for programs. `Scene.with_` checks all together.

        Raises
        ------
        InvalidInput
            If there is no such key, or a value cannot be one of its.
        """
        checked = {name: _checked(type(self), name, value) for name, value in (update or {}).items()}
        return super().model_copy(update=checked, deep=deep)

    def tried(self, **values: Any) -> Self:
        """A copy with other values, unchecked: what a search or a difference tries may lie beyond what can be."""
        return super().model_copy(update=values)


def _checked(model: type[Model], name: str, value: Any) -> Any:
    if name not in model.model_fields:
        raise InvalidInput(f"{name} must be a key of {model.__name__}, got {given(value)}")
    try:
        return _adapter(model, name).validate_python(value)
    except ValidationError as error:
        raise InvalidInput(describe(error, name)) from None


@cache
def _adapter(model: type[Model], name: str) -> TypeAdapter:
    """What checks one key's value."""
    field = model.model_fields[name]
    kind = Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
    try:
        return TypeAdapter(kind, config=ConfigDict(allow_inf_nan=False))
    except PydanticUserError:  # of a part, which has a configuration of its own
        return TypeAdapter(kind)


def _file_name(name: str) -> str:
    if not name or name.strip(" .") != name or _FORBIDDEN.search(name) or not name.isprintable():
        raise ValueError(f"name must be usable as a file's name, got {name!r}")
    return name


FileName = Annotated[str, Field(max_length=100), AfterValidator(_file_name)]
Name = Annotated[str, Field(min_length=1, max_length=100)]
Title = Annotated[str, Field(max_length=1000)]


def rebuild(model: type[Model] = Model) -> None:
    """Make anew what checks all models, parts before what they are parts of, after a change of a registry."""
    _adapter.cache_clear()
    for each in model.__subclasses__():
        each.model_rebuild(force=True)
        rebuild(each)
