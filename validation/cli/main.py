"""The command ``ice``: whatever happens is an answer or one line, and an exit status that tells which.

0: done. 1: the measurement contradicts the prediction, or something could not be measured or finished. 2: bad input.
3: an error of this program, told of in a log file. 130, 143: interrupted, terminated.
"""

from __future__ import annotations

import os
import signal
import sys


def __getattr__(name: str):
    """The application, for those who call it from Python; loaded when it is asked for."""
    if name == "app":
        from validation.cli.application import app

        return app
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


_FLAGS = ("-q", "--quiet", "-v", "--verbose")
_PAUSE = 1.0  # seconds until an interruption that was lost is raised again
_came: list[int] = []  # signals: some libraries keep but the text of an error that they meet


def main() -> None:
    """Entry point. Little is loaded before it begins, so that it is in charge when something goes wrong."""
    from validation.cli.memory import collect_seldom, keep_freed, leave_all
    from validation.cli.streams import make_usable

    make_usable()
    keep_freed()
    collect_seldom()
    code = 3
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, _interrupted)
        code = _run(sys.argv[1:])
        sys.stdout.flush()
    except BrokenPipeError:  # nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 141
    except BaseException as error:
        code = _told(_cause(error))
    finally:
        _again(None)
    leave_all()
    sys.exit(code)


def _run(arguments: list[str]) -> int:
    from validation.cli.application import app

    end = arguments.index("--") if "--" in arguments else len(arguments)
    flags = [a for a in arguments[:end] if a in _FLAGS]  # may stand anywhere
    rest = [a for a in arguments[:end] if a not in _FLAGS] + arguments[end:]
    return app(flags + rest if rest else ["--help"], standalone_mode=False) or 0


def _interrupted(number: int, _frame) -> None:
    """Raise the interruption, and every second once more: an exception that meets a destructor is lost in it."""
    _again(number)
    _interrupt(number)


def _again(number: int | None) -> None:
    """Raise the interruption every second from now on; with None never again."""
    if not hasattr(signal, "setitimer"):
        return
    if number is None:
        signal.signal(signal.SIGALRM, signal.SIG_IGN)
    else:
        signal.signal(signal.SIGALRM, lambda *_: _interrupt(number))
    pause = 0 if number is None else _PAUSE
    signal.setitimer(signal.ITIMER_REAL, pause, pause)


def _interrupt(number: int) -> None:
    from validation.batch.stopped import interruption

    if interruption(sys.exc_info()[1]) is None:  # else it is being dealt with: once is enough
        _came.append(number)  # the error itself would keep all that was going on until Python ends
        raise _error(number)


def _cause(error: BaseException) -> BaseException:
    """What ends an interrupted command is the interruption, whatever a library made of it."""
    from validation.batch.stopped import Interrupted

    return error if isinstance(error, Interrupted) or not _came else _error(_came[-1])


def _error(number: int) -> BaseException:
    from validation.batch.stopped import Interrupted

    return Interrupted("interrupted" if number == signal.SIGINT else "terminated", 128 + number)


def _told(error: BaseException) -> int:
    """Print one line; the exit status."""
    from validation.cli.ending import ending

    line, code = ending(error)
    if line:
        print(line, file=sys.stderr)
    return code


if __name__ == "__main__":
    main()
