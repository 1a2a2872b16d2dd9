"""The command line in this process, for the pages' commands."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from pathlib import Path
from typing import NamedTuple
from unittest import mock

from validation.cli import main as entry


class Done(NamedTuple):
    """What a command has printed, and its exit status."""

    out: str
    err: str
    status: int


def ice(*arguments: str, cwd: Path) -> Done:
    """Run ``ice ARGUMENTS`` in a folder, in this process."""
    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.chdir(cwd),
        mock.patch.object(sys, "argv", ["ice", *arguments]),
        mock.patch.object(entry.signal, "signal"),
        mock.patch.dict(os.environ, COLUMNS="160"),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            entry.main()
        except SystemExit as ended:
            return Done(out.getvalue(), err.getvalue(), int(ended.code or 0))
    raise AssertionError("main must end with SystemExit")
