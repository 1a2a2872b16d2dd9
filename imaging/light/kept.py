"""What is made of many faces at once, and kept of each."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable
from functools import update_wrapper
from threading import RLock
from typing import Any


def kept(most: int) -> Callable[[Callable[[Any, list[int]], Iterable]], Kept]:
    """Of a function of an owner and faces what it gives for each face, as long as it is among the last ``most``.

    Examples
    --------
    >>> @kept(most=2)
    ... def made(owner, faces):
    ...     print("makes", faces)
    ...     return [f"{owner}{face}" for face in faces]
    >>> made("a", [1, 2])
    makes [1, 2]
    ['a1', 'a2']
    >>> made("a", [2, 3, 4])
    makes [3, 4]
    ['a2', 'a3', 'a4']
    >>> made("a", [2])
    makes [2]
    ['a2']
    """
    return lambda make: Kept(make, most)


class Kept:
    """A function of an owner and faces, which is called for faces that are not kept, by one thread at a time."""

    def __init__(self, make: Callable[[Any, list[int]], Iterable], most: int) -> None:
        self._rows: OrderedDict[tuple[Any, int], Any] = OrderedDict()
        self._make, self._most, self._one = make, most, RLock()
        update_wrapper(self, make)

    def __call__(self, owner: Any, faces: list[int]) -> list:
        with self._one:  # blocks of one image ask for the same faces
            rows = {face: self._rows.pop((owner, face)) for face in faces if (owner, face) in self._rows}
            missing = [face for face in faces if face not in rows]
            if missing:
                rows |= zip(missing, self._make(owner, missing), strict=True)
            self._rows |= {(owner, face): row for face, row in rows.items()}
            while len(self._rows) > self._most:
                self._rows.popitem(last=False)
            return [rows[face] for face in faces]

    def cache_clear(self) -> None:
        """Keep nothing of what was made."""
        self._rows.clear()
