"""What all visitors of a page share: one thread for quick answers, another for close looks, processes for long work."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from render import variant as variants
from validation.batch import pool
from validation.batch.work import Chunks, TaskResult, perform

_WORKERS = 2  # at least two: a pool of one is a thread, which would hold up the answers


@dataclass(frozen=True, eq=False)
class Tools:
    """Where work is done.

    Attributes
    ----------
    quick : Executor
        One thread: answers are given one after the other.
    slow : Executor
        Processes, started when first asked.
    free : asyncio.Semaphore
        How many of them are free.
    beside : Executor
        One more thread: a close look of a small part, which would hold up answers, and for which no process is worth
        starting.
    """

    quick: Executor
    slow: Executor
    free: asyncio.Semaphore
    beside: Executor

    async def quickly(self, work: Callable, *arguments: Any) -> Any:
        """What ``work`` gives, in the one thread."""
        return await asyncio.get_running_loop().run_in_executor(self.quick, work, *arguments)

    async def aside(self, work: Callable, *arguments: Any) -> Any:
        """What ``work`` gives, in the other thread; what is no longer wanted before its turn never begins."""
        return await asyncio.get_running_loop().run_in_executor(self.beside, work, *arguments)

    async def slowly(self, work: Callable, *arguments: Any) -> Any:
        """What ``work`` gives, in a process; both must be such that they can be sent there.

        What is no longer wanted before a process is free never begins; what has begun holds its process to the end.
        """
        await self.free.acquire()
        begun = asyncio.get_running_loop().run_in_executor(self.slow, work, *arguments)
        begun.add_done_callback(self._done)
        return await asyncio.shield(begun)

    def _done(self, begun: asyncio.Future) -> None:
        self.free.release()
        if not begun.cancelled():
            begun.exception()  # nobody may be left to ask for it

    async def perform(self, task: Chunks) -> TaskResult:
        """A piece of rendering or measuring."""
        return await self.slowly(perform, task)

    async def variant(self) -> str:
        """Mitsuba's variant, found out by a trial at the first call."""
        return await asyncio.to_thread(lambda: self._variant)

    @cached_property
    def _variant(self) -> str:
        return variants.choose()


class _Left(Exception):
    """The tools are no longer wanted."""


@contextmanager
def open_tools() -> Iterator[Tools]:
    """The tools; at the end work that is under way is not waited for."""
    with ThreadPoolExecutor(1) as quick, ThreadPoolExecutor(1) as beside:
        try:
            workers = max(_WORKERS, pool.cores())
            with pool.local(workers, yielding=True) as crew:
                yield Tools(quick, crew.executor, asyncio.Semaphore(workers), beside)
                raise _Left  # the pool ends its processes at once when an error leaves it
        except _Left:
            pass
