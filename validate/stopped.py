"""Why a run ended before its work was done. What is finished is kept; the same command continues it."""

from __future__ import annotations

CONTINUE = "what is finished is kept; the same command continues the run"


class Stopped(RuntimeError):
    """A run that something outside it has ended. Its text is one line."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"stopped: {reason}; {CONTINUE}")


class Terminated(KeyboardInterrupt):
    """SIGTERM, handled as Ctrl-C is."""
