"""From a TOML file to a checked Scene."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import ValidationError

from scenes.errors import InvalidInput, describe
from scenes.model import Scene

BUNDLED = Path(__file__).parent


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
    path = _find(source)
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidInput(f"{path} must be a readable file, got {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInput(f"{path} must be valid TOML, got {str(error).splitlines()[0]}") from None
    try:
        return Scene.model_validate({"name": path.stem, **document}, context={"directory": path.parent})
    except ValidationError as error:
        raise InvalidInput(f"{path}: {describe(error)}") from None
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from None


def _find(source: str | Path) -> Path:
    if str(source) in names():
        return BUNDLED / f"{source}.toml"
    path = Path(source)
    if path.suffix != ".toml" and not path.exists():
        raise InvalidInput(f"scene must be a TOML file or one of {', '.join(names())}, got {str(source)!r}")
    return path
