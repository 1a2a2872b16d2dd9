"""What every entry of a catalogue has, and what may be wrong with one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from scenes.model import Model, Name, Title
from scenes.ranges import NotNegative

Said = Annotated[float, Field(ge=0, le=1e15)] | None  # a data sheet's number; 0 is told by `contradictions`


@dataclass(frozen=True)
class Contradiction:
    """Two statements of an entry that cannot both be true, or one that cannot.

    Attributes
    ----------
    entry : str
        Kind and name: ``sensors "C-040m"``.
    keys : tuple of str
        Which of its keys.
    text : str
        "X must be ..., got ...", with the numbers.
    """

    entry: str
    keys: tuple[str, ...]
    text: str


class Entry(Model):
    """One part that can be bought, as its maker tells of it."""

    name: Name
    """Maker and model."""
    source: Title = ""
    """Where its figures are published."""
    price: NotNegative | None = None
    """In the catalogue's currency."""

    table: ClassVar[str]
    """The catalogue's table that it stands in."""
    positive: ClassVar[tuple[str, ...]] = ()
    """Keys whose 0 can only stand for a value that is missing."""
    needed: ClassVar[tuple[str, ...]] = ()
    """Keys without which a station cannot be predicted."""

    @property
    def told(self) -> str:
        """Its table and name, for messages."""
        return f'{self.table} "{self.name}"'

    @property
    def missing(self) -> tuple[str, ...]:
        """Keys without which it cannot be used."""
        return tuple(key for key in self.needed if not getattr(self, key))

    def contradictions(self) -> tuple[Contradiction, ...]:
        """What its statements make impossible, each with its numbers."""
        zero = [
            self.against((key,), f"{key} must be left out where it is not known, got 0")
            for key in (*self.positive, "price")
            if getattr(self, key) == 0
        ]
        return tuple(zero) + (() if zero else tuple(self.checked()))

    def checked(self) -> Iterator[Contradiction]:
        """Contradictions of its own kind; nothing here."""
        return iter(())

    def against(self, keys: tuple[str, ...], text: str) -> Contradiction:
        """One about some of its keys."""
        return Contradiction(self.told, keys, text)

    def differs(self, key: str, value: float, others: tuple[str, ...], wide: float) -> Iterator[Contradiction]:
        """Where a key is farther from what others make of it than ``wide``."""
        given = getattr(self, key)
        if given is not None and abs(given - value) > wide:
            of = " and ".join(others)
            yield self.against((key, *others), f"{key} must be {value:.4g} +- {wide:.2g} by {of}, got {given:g}")
