"""The command line in this process: 1 to 2 s sooner than in one of its own, which few tests need."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple, TextIO
from unittest import mock

from validation.cli import main as entry
from validation.cli import verbosity


class Done(NamedTuple):
    """What a command has printed, and its exit status; named as of a process that has ended."""

    stdout: str
    stderr: str
    returncode: int


def ice(*arguments: object, cwd: Path | None = None) -> Done:
    """Run ``ice ARGUMENTS`` in a folder, in this process, for a terminal of 160 columns."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(cwd or Path.cwd()):
        code = status(arguments, out, err)
    return Done(out.getvalue(), err.getvalue(), code)


def status(arguments: Iterable[object], out: TextIO | None, err: TextIO) -> int:
    """Exit status of ``ice ARGUMENTS`` that prints on these streams; None is a closed one."""
    with (
        mock.patch.object(sys, "argv", ["ice", *map(str, arguments)]),
        mock.patch.object(entry, "signal"),  # the tests' own handlers stay
        mock.patch.dict(os.environ, COLUMNS="160"),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            entry.main()
        except SystemExit as ended:
            return int(ended.code or 0)
        finally:
            verbosity.choose(False, False)
            if out is None and sys.stdout is not None:
                sys.stdout.close()  # what took the place of the closed one
    raise AssertionError("main must end with SystemExit")
