"""Kinds of things by their names: those of the project, and those of a user's own module."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from functools import reduce
from operator import or_
from typing import Annotated, Any, Generic, Literal, TypeVar, cast

from pydantic import AfterValidator, Discriminator, GetCoreSchemaHandler, Tag

from scenes.errors import KIND, InvalidInput, given

Kind = TypeVar("Kind")
Given = TypeVar("Given")  # what a decorator is given, it gives back


class Registry(Collection[str], Generic[Kind]):
    """Kinds of one noun by name.

    A module of a user's own adds one with `add`, as decorator or called; it is found where the project's own are
    (`scenes.plugins` says how the command line loads such a module).

    Examples
    --------
    >>> colours = Registry("colour")
    >>> colours.add("red")(1.0), colours.names, colours["red"]
    (1.0, ('red',), 1.0)
    >>> colours["blue"]
    Traceback (most recent call last):
    ...
    scenes.errors.InvalidInput: colour must be one of red, got 'blue'
    """

    def __init__(self, noun: str) -> None:
        self.noun = noun
        self._kinds: dict[str, Kind] = {}
        self._dependants: list[Callable[[], Any]] = []

    def add(self, name: str) -> Callable[[Given], Given]:
        """A decorator that makes a kind known by its name.

        Raises
        ------
        InvalidInput
            If another kind has the name.
        """

        def known(kind: Given) -> Given:
            other = self._kinds.get(name)
            if other is not None and other != kind:
                raise InvalidInput(f"{self.noun} must have a name of its own, got {name!r}, which is {other!r}")
            self._kinds[name] = cast("Kind", kind)
            for rebuild in self._dependants:
                rebuild()
            return kind

        return known

    def remove(self, name: str) -> None:
        """Forget a kind: what a test does with the kind that it added."""
        del self._kinds[name]
        for rebuild in self._dependants:
            rebuild()

    def followed_by(self, rebuild: Callable[[], Any]) -> None:
        """Have a function called whenever the kinds change."""
        self._dependants.append(rebuild)

    @property
    def names(self) -> tuple[str, ...]:
        """In the order in which they were added."""
        return tuple(self._kinds)

    def __getitem__(self, name: str) -> Kind:
        """The kind of a name; `InvalidInput` where there is none."""
        if not isinstance(name, str) or name not in self._kinds:
            raise InvalidInput(f"{self.noun} must be one of {', '.join(self._kinds)}, got {given(name)}")
        return self._kinds[name]

    def __len__(self) -> int:
        return len(self._kinds)

    def __contains__(self, name: object) -> bool:
        return name in self._kinds

    def __iter__(self) -> Iterator[str]:
        return iter(self._kinds)


class OneOf:
    """Annotation of a field whose value is a model of one of a registry's kinds, told by its key ``kind``."""

    def __init__(self, kinds: Registry, default: str = "") -> None:
        self._kinds, self._default = kinds, default

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        kinds = [Annotated[self._kinds[name], Tag(KIND + name)] for name in self._kinds]
        if not kinds:
            return handler.generate_schema(Annotated[dict, AfterValidator(self._unknown)])
        return handler.generate_schema(Annotated[reduce(or_, kinds), Discriminator(self._name)])

    def _unknown(self, value: dict) -> Any:
        raise ValueError(
            f"{self._kinds.noun} must be one that a module of your own adds, got {given(value.get('kind'))}"
        )

    def _name(self, value: Any) -> str:
        named = value.get("kind", self._default) if isinstance(value, dict) else getattr(value, "kind", self._default)
        return KIND + (named if isinstance(named, str) else repr(named))


class NameOf:
    """Annotation of a field whose value is the name of one of a registry's kinds."""

    def __init__(self, kinds: Registry) -> None:
        self._kinds = kinds

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        return handler.generate_schema(Literal[tuple(self._kinds)])
