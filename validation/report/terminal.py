"""Where tables are printed: all texts as they are, for names and titles are the user's and no markup."""

from __future__ import annotations

from typing import Any

from rich.console import Console


def console(*, stderr: bool = False) -> Console:
    """A console wide enough for the tables even where no terminal tells its width."""
    made = _plain(stderr=stderr)
    return made if made.is_terminal else _plain(stderr=stderr, width=150)


def _plain(**how: Any) -> Console:
    return Console(markup=False, emoji=False, **how)
