"""Files that a campaign's scenes read, parts and textures: where they are, and what they hold."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_DIGITS = 16  # of a digest that a run is known by


def contents(campaign: dict[str, Any], directory: Path = Path()) -> dict[str, str]:
    """Digest of each file that a campaign's document names, by its name; of one that cannot be read "".

    Names are relative to ``directory``.
    """
    return {name: whole[:_DIGITS] for name, whole in digests(campaign, directory).items()}


def digests(document: dict[str, Any], directory: Path = Path()) -> dict[str, str]:
    """The same, of any document, as whole SHA-256."""
    return {name: digest(directory / name) for name in dict.fromkeys(_named(document))}


def by_content(identity: dict[str, Any]) -> dict[str, Any]:
    """A run's identity with what its files hold instead of where they are: the same from every folder."""
    return {**identity, "campaign": _replaced(identity["campaign"], identity.get("files", {})), "files": None}


def _named(document: Any) -> Iterator[str]:
    if isinstance(document, dict):
        for key, value in document.items():
            if key == "file" and isinstance(value, str):
                yield value
            else:
                yield from _named(value)
    elif isinstance(document, list):
        for value in document:
            yield from _named(value)


def _replaced(document: Any, digests: dict[str, str]) -> Any:
    if isinstance(document, dict):
        return {
            key: _content(value, digests) if key == "file" and isinstance(value, str) else _replaced(value, digests)
            for key, value in document.items()
        }
    return [_replaced(value, digests) for value in document] if isinstance(document, list) else document


def _content(name: str, digests: dict[str, str]) -> str:
    return f"content {digests.get(name) or 'unknown'} of {Path(name).name}"


def digest(file: Path) -> str:
    """SHA-256 of a file; of one that cannot be read ""."""
    try:
        with file.open("rb") as opened:
            return hashlib.file_digest(opened, "sha256").hexdigest()
    except OSError:
        return ""
