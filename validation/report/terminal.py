"""Where tables are printed."""

from __future__ import annotations

from rich.console import Console


def console(*, stderr: bool = False) -> Console:
    """A console wide enough for the tables even where no terminal tells its width."""
    made = Console(stderr=stderr)
    return made if made.is_terminal else Console(stderr=stderr, width=150)
