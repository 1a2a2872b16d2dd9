"""What every part of a scene is: a frozen, checked record."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

_FORBIDDEN = re.compile(r'[\x00-\x1f\x7f/\\:*?"<>|]')  # by some file system


class Model(BaseModel):
    """Frozen, without unknown keys, without NaN or infinity.

    What a key means is said below it, for readers and for `scenes.reference`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


def _file_name(name: str) -> str:
    if not name or name.strip(" .") != name or _FORBIDDEN.search(name) or not name.isprintable():
        raise ValueError(f"name must be usable as a file's name, got {name!r}")
    return name


FileName = Annotated[str, Field(max_length=100), AfterValidator(_file_name)]
Name = Annotated[str, Field(min_length=1, max_length=100)]
Title = Annotated[str, Field(max_length=1000)]
