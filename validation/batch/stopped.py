"""Why a run ended before its work was done. What is finished is kept; the same command continues it."""

from __future__ import annotations

CONTINUE = "what is finished is kept; the same command continues the run"


class Stopped(RuntimeError):
    """A run that something outside it has ended. Its text is one line."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"stopped: {reason}; {CONTINUE}")


class Interrupted(BaseException):
    """Ctrl-C or SIGTERM. Not a KeyboardInterrupt, which typer swallows; ``status`` is the exit status."""

    def __init__(self, word: str, status: int) -> None:
        super().__init__(f"stopped: {word}")
        self.word, self.status = word, status


def interruption(error: BaseException | None) -> Interrupted | None:
    """The interruption that an error is, or that a library which met it made another error of; None if neither."""
    while error is not None and not isinstance(error, Interrupted):
        error = error.__cause__ or error.__context__
    return error
