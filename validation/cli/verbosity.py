"""How much is said on standard error: -q nothing but errors, -v also what is done."""

from __future__ import annotations

import logging

from scenes.errors import InvalidInput

_quiet = _verbose = False


def choose(quiet: bool, verbose: bool) -> None:
    """Set it for this process.

    Raises
    ------
    InvalidInput
        If both are wanted.
    """
    global _quiet, _verbose
    if quiet and verbose:
        raise InvalidInput("-q must be given without -v, got both")
    _quiet, _verbose = quiet, verbose
    if verbose:
        log, shown = logging.getLogger("validation"), logging.StreamHandler()
        shown.setFormatter(_Line())
        log.addHandler(shown)
        log.setLevel(logging.INFO)


def hush() -> None:
    """Warnings of libraries, and what a reader of meshes logs, are no lines of their own; -v shows them."""
    logging.captureWarnings(True)
    for name in ("py.warnings", "trimesh"):
        told = logging.getLogger(name)
        told.propagate = False
        told.addHandler(logging.StreamHandler() if _verbose else logging.NullHandler())


def quiet() -> bool:
    """Whether progress is not wanted."""
    return _quiet


class _Line(logging.Formatter):
    """Event and facts in a line."""

    def format(self, record: logging.LogRecord) -> str:
        facts = " ".join(f"{name}={value}" for name, value in getattr(record, "facts", {}).items())
        return f"{record.getMessage()} {facts}".rstrip()
