"""Who does the work: local processes, or the workers of a Dask cluster, behind one `concurrent.futures.Executor`."""

from __future__ import annotations

import logging
import multiprocessing
import os
import re
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection

from scenes import InvalidInput
from validation.batch.stopped import Stopped

_ANSWER_S = 4.0  # within which a host answers


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
def local(workers: int) -> Iterator[Crew]:
    """Processes on this machine; one worker is a thread of this process.

    The processes end with this one, however it ends: each watches a pipe whose other end only this process holds.
    """
    if workers == 1:
        with ThreadPoolExecutor(1) as executor:
            try:
                yield Crew(executor, lambda: 1)
            finally:
                executor.shutdown(cancel_futures=True)
        return
    context = multiprocessing.get_context("spawn")  # the renderer's threads do not survive a fork
    ours, theirs = context.Pipe()
    executor = ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(theirs,))
    try:
        yield Crew(executor, lambda: workers)
    except BaseException:
        ours.close()
        theirs.close()
        raise
    finally:
        executor.shutdown(cancel_futures=True)
        ours.close()
        theirs.close()


def _begin(lifeline: Connection) -> None:
    """In a worker: leave Ctrl-C to the main process, and end when that is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Connection) -> None:
    try:
        lifeline.poll(None)
    finally:
        os._exit(1)


def check_address(address: str) -> None:
    """See that a scheduler's address has the form of one, and that somebody answers at it if it is a host's.

    Raises
    ------
    InvalidInput
        If not.
    """
    form = re.fullmatch(r"(?:([a-z]+)://)?\[?([\w.:%-]+?)\]?:(\d{1,5})", address)
    if not form and not re.fullmatch(r"inproc://\S+", address):
        raise InvalidInput(f"--dask must be an address such as tcp://127.0.0.1:8786, got {address!r}")
    if form and form[1] in (None, "tcp", "tls"):
        try:
            socket.create_connection((form[2], int(form[3])), timeout=_ANSWER_S).close()
        except (OSError, OverflowError, UnicodeError) as error:
            reason = f"{address} ({_line(error)})"
            raise InvalidInput(f"--dask must be the address of a running scheduler, got {reason}") from None


@contextmanager
def dask(address: str, patience: float = 10.0) -> Iterator[Crew]:
    """The workers of a running Dask cluster.

    Parameters
    ----------
    address : str
        Of the scheduler, as "tcp://127.0.0.1:8786".
    patience : float
        Seconds to wait for an answer of the scheduler.

    Raises
    ------
    InvalidInput
        If Dask is not installed, or no scheduler answers at the address.
    """
    check_address(address)
    try:
        from distributed import Client
    except ImportError:
        raise InvalidInput("--dask must be used with the extra 'dask' installed, got no package distributed") from None
    log = logging.getLogger("distributed")
    former = log.level
    log.setLevel(logging.CRITICAL)  # its reports of a lost scheduler are pages long; ours is one line
    try:
        client = Client(address, timeout=patience, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InvalidInput(
            f"--dask must be the address of a running scheduler, got {address} ({_line(error)})"
        ) from None
    executor = client.get_executor(pure=False)
    try:
        yield Crew(
            executor, lambda: max(1, sum(client.nthreads().values())), lambda error: _check(client, address, error)
        )
    finally:
        executor.shutdown(wait=False)  # which cancels
        client.close(timeout=2)
        log.setLevel(former)


def _check(client, address: str, error: Exception | None) -> None:
    from distributed.scheduler import KilledWorker

    try:
        if client.status != "running":
            raise OSError(f"the client is {client.status}")
        client.scheduler_info()
        client.nthreads()
    except (OSError, TimeoutError, ValueError) as gone:
        raise Stopped(f"the Dask scheduler at {address} is gone ({_line(gone)})") from None
    if isinstance(error, KilledWorker):
        raise BrokenExecutor(_line(error))


def _line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
