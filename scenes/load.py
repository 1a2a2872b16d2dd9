"""From a TOML file to a checked Scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from scenes.errors import InvalidInput, describe, given
from scenes.files.door import read_toml
from scenes.scene import Scene

BUNDLED = Path(__file__).parent / "bundled"


def names() -> tuple[str, ...]:
    """Names of the bundled scenes."""
    return tuple(sorted(path.stem for path in BUNDLED.glob("*.toml")))


def load(source: str | Path) -> Scene:
    """Read a scene.

    Parameters
    ----------
    source : str or Path
        Name of a bundled scene, or path of a TOML file.

    Raises
    ------
    InvalidInput
        If there is no such scene, the file cannot be read or is no TOML, or a value in it is bad. The
        text is one line that names the file and the key.

    Examples
    --------
    >>> load("task1").task.edges
    ('e4', 'e9', 'e7', 'e11')
    """
    path = find(source)
    return from_document(path, read_toml(path))


def from_document(path: Path, document: dict[str, Any]) -> Scene:
    """The scene that a file's document describes; errors as of `load`."""
    try:
        return Scene.model_validate({"name": path.stem, **document}, context={"directory": path.parent})
    except ValidationError as error:
        raise InvalidInput(f"{path}: {describe(error)}") from None
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from None


def find(source: str | Path) -> Path:
    """Path of a scene's file; errors as of `load`, if there can be none."""
    if not isinstance(source, str | Path):
        raise InvalidInput(f"scene must be a name or a path, got {given(source)}")
    if str(source) in names():
        return BUNDLED / f"{source}.toml"
    path = Path(source)
    try:
        known = path.suffix == ".toml" or path.exists()
    except (OSError, ValueError):  # a name too long for the file system, or with a null character in it
        known = False
    if not known:
        raise InvalidInput(f"scene must be a TOML file or one of {', '.join(names())}, got {str(source)!r}")
    return path
