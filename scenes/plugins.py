"""Modules of a user's own that add kinds of lights, estimators and effects to the registries.

A scene file can never load code. Code is loaded where the one who runs the command says so: ``ice --plugin MODULE``, or
a package that is installed beside this one and names its modules under the entry point group ``ice_vision.kinds``.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

from scenes.errors import InvalidInput

GROUP = "ice_vision.kinds"
_loaded: list[str] = []


def load(name: str) -> None:
    """Import a module, from the current folder too, so that its kinds are known; again is once.

    Raises
    ------
    InvalidInput
        If there is no such module, or it cannot be imported; one line that names it and the reason.
    """
    if name in _loaded:
        return
    if not all(part.isidentifier() for part in name.split(".")):
        raise InvalidInput(f"--plugin must be a module's name such as my_lights, got {name!r}")
    here = str(Path.cwd())
    sys.path.append(here)  # behind all else: no file of the folder stands for a package that is installed
    try:
        import_module(name)
    except InvalidInput:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InvalidInput(f"--plugin must be a module that can be imported, got {name!r}: {reason}") from error
    finally:
        sys.path.remove(here)
    _loaded.append(name)


def load_installed() -> None:
    """Import what installed packages name in the entry point group."""
    for each in entry_points(group=GROUP):
        load(each.module)


def loaded() -> tuple[str, ...]:
    """Names of the modules that were loaded: what a worker process has to load, too."""
    return tuple(_loaded)
