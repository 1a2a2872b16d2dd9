"""Digest of the program's own files: numbers that are kept are taken for those of the code that made them alone."""

from __future__ import annotations

import hashlib
from pathlib import Path
from types import ModuleType


def digest(packages: tuple[ModuleType, ...], modules: tuple[ModuleType, ...] = ()) -> bytes:
    """SHA-256 of all that packages hold, and of single modules, in order."""
    folders = [Path(str(package.__file__)).parent for package in packages]
    files = [file for folder in folders for file in sorted(folder.rglob("*.py"))]
    files += [Path(str(module.__file__)) for module in modules]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).digest()
