"""The workers of a Dask cluster, behind a `concurrent.futures.Executor`."""

from __future__ import annotations

import asyncio
import logging
import re
import socket
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager

from scenes import InvalidInput
from validation.batch.pool import Crew
from validation.batch.stopped import Stopped

_ANSWER_S = 2.0  # within which a host answers, and within which a scheduler does


def check_address(address: str) -> None:
    """See that a scheduler's address has the form of one, and that a scheduler answers at it if it is a host's.

    Raises
    ------
    InvalidInput
        If not, after `_ANSWER_S` seconds at most; or if Dask is not installed.
    """
    form = re.fullmatch(r"(?:([a-z]+)://)?\[?([\w.:%-]+?)\]?:(\d{1,5})", address)
    if not form and not re.fullmatch(r"inproc://\S+", address):
        raise InvalidInput(f"--dask must be an address such as tcp://127.0.0.1:8786, got {address!r}")
    if form and form[1] in (None, "tcp", "tls"):
        try:
            socket.create_connection((form[2], int(form[3])), timeout=_ANSWER_S).close()
        except (OSError, OverflowError, UnicodeError) as error:
            raise _no_scheduler(address, error) from None
        with _silent():
            _ask(address)


def _ask(address: str) -> None:
    """A live port need not be a scheduler's."""
    _installed()
    from distributed.comm import connect
    from distributed.core import send_recv

    async def kind() -> str:
        comm = await connect(address, timeout=_ANSWER_S)
        try:
            return (await send_recv(comm, op="identity"))["type"]
        finally:
            comm.abort()

    try:
        found = asyncio.run(asyncio.wait_for(kind(), _ANSWER_S))
    except TimeoutError:
        raise _no_scheduler(address, "no answer") from None
    except OSError as error:
        raise _no_scheduler(address, error) from None
    except Exception:  # whatever a stranger's bytes may cause
        raise _no_scheduler(address, "something else answers") from None
    if found != "Scheduler":
        raise _no_scheduler(address, f"a {found} answers")


def _installed() -> None:
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InvalidInput("--dask must be used with the extra 'dask' installed, got no package distributed") from None


def _no_scheduler(address: str, reason: object) -> InvalidInput:
    return InvalidInput(f"--dask must be the address of a running scheduler, got {address} ({_line(reason)})")


@contextmanager
def _silent() -> Iterator[None]:
    """Dask's reports of a lost scheduler are pages long; ours is one line."""
    log = logging.getLogger("distributed")
    former = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        log.setLevel(former)


@contextmanager
def dask(address: str, patience: float = 10.0) -> Iterator[Crew]:
    """The workers of a running Dask cluster.

    Parameters
    ----------
    address : str
        Of the scheduler, as "tcp://127.0.0.1:8786".
    patience : float
        Seconds to wait for a scheduler that has answered once.

    Raises
    ------
    InvalidInput
        If Dask is not installed, or no scheduler answers at the address.
    """
    check_address(address)
    _installed()
    from distributed import Client

    with _silent():
        try:
            client = Client(address, timeout=patience, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise _no_scheduler(address, error) from None
        executor = client.get_executor(pure=False)
        try:
            yield Crew(
                executor, lambda: max(1, sum(client.nthreads().values())), lambda error: _check(client, address, error)
            )
        finally:
            executor.shutdown(wait=False)  # which cancels
            client.close(timeout=2)


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


def _line(error: object) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
