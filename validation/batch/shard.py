"""A part of a run's settings: machines that share nothing each work on one, and their run files are put together."""

from __future__ import annotations

import re
from dataclasses import dataclass

from scenes import InvalidInput


@dataclass(frozen=True)
class Shard:
    """Every ``of``-th setting, from the ``number``-th on, counted from 1: neighbours in a grid cost about the same.

    Raises
    ------
    InvalidInput
        If it is not one of so many.

    Examples
    --------
    >>> list(Shard(2, 3).settings(8))
    [1, 4, 7]
    """

    number: int = 1
    of: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.of:
            raise InvalidInput(f"shard must be i/n with i from 1 to n, got {self}")

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Of a text.

        >>> Shard.parse("2/3")
        Shard(number=2, of=3)
        """
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip(), re.ASCII)
        if not found:
            raise InvalidInput(f"shard must be i/n with i from 1 to n, got {text!r}")
        return cls(*map(int, found.groups()))

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    def settings(self, count: int) -> range:
        """Numbers of its settings, from 0, of so many.

        Raises
        ------
        InvalidInput
            If there are none for it.
        """
        if self.number > count:
            raise InvalidInput(f"shard must be one of as many as there are settings ({count}) at most, got {self}")
        return range(self.number - 1, count, self.of)
