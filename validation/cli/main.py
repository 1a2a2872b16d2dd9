"""The command ``ice``: every module of `validation.cli` adds its commands to one application."""

from __future__ import annotations

import errno
import re
import sys

import typer

from scenes import InvalidInput
from validation.batch.stopped import CONTINUE, Interrupted, Stopped
from validation.cli import batch, calibrate, compare, cost, effects, hard, image, plan, report  # noqa: F401
from validation.cli.common import app

_UsageError = typer.BadParameter.__base__  # typer does not export it
_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def main() -> None:
    """Entry point: bad input is one line on standard error and exit status 2."""
    try:
        code = app(standalone_mode=False)
    except InvalidInput as error:
        print(error, file=sys.stderr)
        code = 2
    except _UsageError as error:
        print(_usage(error), file=sys.stderr)
        code = 2
    except Stopped as error:
        print(error, file=sys.stderr)
        code = 1
    except OSError as error:
        if error.errno not in _DISK:
            raise
        print(
            f"stopped: {error.filename or 'a file'} could not be written ({error.strerror}); {CONTINUE}",
            file=sys.stderr,
        )
        code = 1
    except Interrupted as error:
        print(error, file=sys.stderr)
        code = error.status
    sys.exit(code)


def _usage(error: Exception) -> str:
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
    return f"{name} must be {wanted}, got {problem.get('input')!r}"


if __name__ == "__main__":
    main()
