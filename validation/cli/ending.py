"""How a command that raised an error ends: one line, and an exit status."""

from __future__ import annotations

import errno
import os
import re
import tempfile
import traceback
from typing import Any

import typer

from scenes.errors import InvalidInput, one_line
from validation.batch.stopped import Interrupted, Stopped, interruption

_UsageError = typer.BadParameter.__base__  # typer does not export it
_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NO_ENTRY = (
    errno.ENOENT, errno.EACCES, errno.EPERM, errno.EROFS, errno.EISDIR, errno.ENOTDIR, errno.EEXIST,
    errno.ENAMETOOLONG, errno.ELOOP, errno.ENXIO,
)  # fmt: skip


def ending(error: BaseException) -> tuple[str, int]:
    """What is said of an error, in one line, and the exit status.

    An interruption counts as one also where a library that it met made another error of it.
    """
    error = interruption(error) or error
    if isinstance(error, SystemExit):
        return "", error.code if isinstance(error.code, int) else 0
    if isinstance(error, InvalidInput):
        return str(error), 2
    if isinstance(error, _UsageError):
        return one_line(usage(error)), 2
    if isinstance(error, Interrupted):
        return str(error), error.status
    if isinstance(error, Stopped):
        return one_line(str(error)), 1
    if isinstance(error, OSError) and error.errno in _DISK:
        name = os.fsdecode(error.filename) if error.filename else "a file"
        return one_line(f"stopped: {name} could not be written ({error.strerror})"), 1
    if isinstance(error, OSError) and error.errno in _NO_ENTRY and error.filename:
        return one_line(f"{os.fsdecode(error.filename)} must be a usable path, got: {error.strerror}"), 2
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return "stopped: interrupted", 130
    return _internal(error), 3


def _internal(error: BaseException) -> str:
    """One line about an error of this program; its traceback goes to a file of its own."""
    said = one_line(f"internal error: {type(error).__name__}: {error}", 300)
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="ice-", suffix=".log", delete=False, encoding="utf-8", errors="backslashreplace"
        ) as log:
            traceback.print_exception(error, file=log)
    except OSError as problem:
        return f"{said} (no log could be written: {problem.strerror})"
    return f"{said} (traceback in {log.name})"


def usage(error: Any) -> str:
    """A usage error as "X must be ..., got ..."."""
    message = str(error.message).rstrip(".")
    parameter = getattr(error, "param", None)
    if parameter is None:
        unknown = re.match(r"No such (option|command):? '?([^' ]+)'?", message)
        known = f"{unknown[1]} must be a known one (see --help), got {unknown[2]!r}" if unknown else None
        return known or f"the command line must be usable (see --help), got: {message}"
    name = parameter.opts[0] if parameter.opts[0].startswith("-") else parameter.name.upper()
    if not message or message.startswith("Missing"):
        return f"{name} must be given, got nothing"
    problem = getattr(error.__cause__, "errors", lambda: [{}])()[0]
    wanted = re.sub(r"^Input should be |, unable to parse.*$", "", message)
    if wanted.startswith("Unable to parse"):  # more digits than Python reads
        wanted = "a number of fewer digits"
    return f"{name} must be {wanted}, got {one_line(repr(problem.get('input')), 100)}"
