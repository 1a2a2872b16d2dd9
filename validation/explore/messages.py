"""What a page may say. Each message is checked here, before anything looks at it."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from scenes import InvalidInput
from scenes.errors import describe

_MOST_NUMBER = 2**53  # beyond, JavaScript's numbers are not exact


class Message(BaseModel):
    """One message: what is wanted, and what goes with it."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    type: Literal["state", "restore", "best", "prove", "render", "cancel", "save"]
    state: Any = None
    """Of ``state`` and ``restore``: checked by `State.of_message`, which knows the scene."""
    rest: bool = False
    """Whether nothing moves any more."""
    number: Annotated[int, Field(ge=0, le=_MOST_NUMBER)] = 0
    """Given back with the answer."""
    replace: bool = False
    """Whether ``save`` may replace a file."""

    @classmethod
    def of(cls, text: str) -> Message:
        """That of a text.

        Raises
        ------
        InvalidInput
            If it is none.

        Examples
        --------
        >>> Message.of('{"type": "save", "replace": true}').replace
        True
        """
        try:
            told = json.loads(text)
        except (ValueError, RecursionError):
            raise InvalidInput(f"message must be JSON, got {text[:80]!r}") from None
        if not isinstance(told, dict):
            raise InvalidInput(f"message must be an object, got {text[:80]!r}")
        try:
            return cls.model_validate(told)
        except ValidationError as error:
            raise InvalidInput(describe(error)) from None
