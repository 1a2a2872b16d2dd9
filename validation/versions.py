"""Versions of what is installed, for records: that one has no metadata, as in a source tree, is no reason to stop."""

from __future__ import annotations

from importlib import metadata

PROGRAM = "ice-vision"


def version(name: str = PROGRAM) -> str:
    """Of a distribution by its name; ``not installed`` where there is none of this name.

    >>> version("no such distribution")
    'not installed'
    """
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def required() -> list[str]:
    """What the program's metadata say that it needs, as `packaging` writes it; nothing in a source tree."""
    try:
        return metadata.requires(PROGRAM) or []
    except metadata.PackageNotFoundError:
        return []
