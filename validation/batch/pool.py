"""Who does the work: local processes behind one `concurrent.futures.Executor`."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.process import BaseProcess

from scenes import plugins

_PATIENCE = 10  # steps of niceness of workers that leave the cores to others


@dataclass(frozen=True)
class Crew:
    """An executor, and how many tasks it can work on at a time.

    ``check(error)`` is asked when a task raised an error, or None when nothing has come for a while: it raises
    `Stopped` if the executor is out of reach, and BrokenExecutor if the error means that a worker died.
    """

    executor: Executor
    size: Callable[[], int]
    check: Callable[[Exception | None], None] = lambda error: None


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def local(workers: int, *, yielding: bool = False) -> Iterator[Crew]:
    """Processes on this machine; one worker is a thread of this process.

    ``yielding``: they leave the cores to whatever else wants them. The processes end with this one, however it ends:
    each watches a pipe whose other end only this process holds.
    """
    if workers == 1:
        with ThreadPoolExecutor(1) as executor:
            try:
                yield Crew(executor, lambda: 1)
            finally:
                executor.shutdown(cancel_futures=True)
        return
    context, others = _Spawn(), set(multiprocessing.active_children())
    ours, theirs = context.Pipe()
    executor = ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(theirs, plugins.loaded(), yielding))
    known: set[BaseProcess] = set()

    def check(error: Exception | None) -> None:
        """A worker that was killed while it sent a result leaves the pool waiting for the rest of it."""
        here = set(multiprocessing.active_children()) - others
        if error is None and known - here:
            raise BrokenProcessPool("a worker process has ended")
        known.update(here)

    try:
        yield Crew(executor, lambda: workers, check)
    except BaseException:
        ours.close()
        theirs.close()
        _end(set(multiprocessing.active_children()) - others)
        _hang_up(executor)
        raise
    finally:
        executor.shutdown(cancel_futures=True)
        ours.close()
        theirs.close()


def _hang_up(executor: ProcessPoolExecutor) -> None:
    """Close the last writing end of the results' pipe, so that the pool's thread reads its end and not for ever."""
    queue = getattr(executor, "_result_queue", None)
    if queue is not None:
        queue._writer.close()


def _end(processes: set[BaseProcess]) -> None:
    """At once: one that is just starting would miss what this process takes with it, and say so."""
    for process in processes:
        process.kill()
    for process in processes:
        process.join()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Signals that arrive meanwhile are dealt with afterwards, and processes started meanwhile never hear Ctrl-C."""
    late: list[int] = []
    here = threading.current_thread() is threading.main_thread()
    handlers = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)} if here else {}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # of this thread; new processes inherit it
    try:
        for number in handlers:  # a signal that another thread receives is handled in this one all the same
            signal.signal(number, lambda number, _frame: late.append(number))
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for number, handler in handlers.items():
            signal.signal(number, handler)
    for number in late:
        signal.raise_signal(number)


class _Deaf(SpawnProcess):
    """A process that does not hear Ctrl-C, which a terminal sends to the workers, too, from its first instruction."""

    def start(self) -> None:
        if not hasattr(signal, "pthread_sigmask"):
            return super().start()
        resource_tracker.ensure_running()  # now: its own start unblocks the signal
        with _undisturbed():
            return super().start()


class _Spawn(SpawnContext):
    """The renderer's threads do not survive a fork."""

    Process = _Deaf


def _begin(lifeline: Connection, modules: tuple[str, ...], yielding: bool) -> None:
    """In a worker: leave Ctrl-C to the main process, end when that is gone, and know the kinds that it knows."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if yielding and hasattr(os, "nice"):
        os.nice(_PATIENCE)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
    for name in modules:
        plugins.load(name)


def _end_with(lifeline: Connection) -> None:
    try:
        lifeline.poll(None)
    finally:
        os._exit(1)
