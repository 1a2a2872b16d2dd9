"""Where a command is to write: looked at before the work, so that it is not lost."""

from __future__ import annotations

import os
from pathlib import Path

from scenes.errors import InvalidInput


def check_file(option: str, path: Path | None, *suffixes: str) -> None:
    """See that a file can be written.

    Raises
    ------
    InvalidInput
        If it has none of the suffixes, is something other than a file, or its directory is not there or not writable.
    """
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        raise InvalidInput(f"{option} must end in {', '.join(suffixes)}, got {str(path)!r}")
    try:
        odd = path.exists() and not path.is_file()
        free = os.access(path if path.exists() else path.parent, os.W_OK) and path.parent.is_dir()
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{option} must be a writable file, got {str(path)!r} ({_reason(error)})") from None
    if odd or not free:
        reason = "is no file" if odd else "no such directory" if not path.parent.is_dir() else "not permitted"
        raise InvalidInput(f"{option} must be a writable file, got {path} ({reason})")


def check_directory(option: str, path: Path | None) -> None:
    """See that a directory can be written, or made.

    Raises
    ------
    InvalidInput
        If it or one above it is no directory, or not writable.
    """
    if path is None:
        return
    try:
        there = next(known for known in (path, *path.absolute().parents) if known.exists())
        reason = "" if there.is_dir() else f"{there} is no directory"
    except (OSError, ValueError) as error:
        reason = _reason(error)
    if not reason and not os.access(there, os.W_OK | os.X_OK):
        reason = f"{there} is not writable"
    if reason:
        raise InvalidInput(f"{option} must be a writable directory, got {str(path)!r} ({reason})")


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
