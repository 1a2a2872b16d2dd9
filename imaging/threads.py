"""Blocks of a long array in threads: what NumPy and Embree make of one stays near to the processor."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

_WORKERS = min(os.cpu_count() or 1, 4)
T = TypeVar("T")


def each(made: Callable[[slice], T], count: int, size: int) -> list[T]:
    """What is made of each block of so many of a count, in order, on all processor cores; none of none.

    Examples
    --------
    >>> each(lambda block: (block.start, block.stop), 5, 2)
    [(0, 2), (2, 4), (4, 5)]
    """
    size = max(size, 1)
    blocks = [slice(at, min(at + size, count)) for at in range(0, count, size)]
    if len(blocks) <= 1:
        return [made(block) for block in blocks]
    with ThreadPoolExecutor(_WORKERS) as pool:
        return list(pool.map(made, blocks))
