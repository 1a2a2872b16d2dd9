"""From a TOML file to a checked Scene."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import ValidationError

from scenes.errors import InvalidInput, describe
from scenes.scene import Scene

BUNDLED = Path(__file__).parent
_MOST_BYTES = 1 << 20


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
        with path.open("rb") as file:
            text = file.read(_MOST_BYTES + 1)
        if len(text) > _MOST_BYTES:
            raise InvalidInput(f"{path} must be at most {_MOST_BYTES} bytes long, got more")
        document = tomllib.loads(text.decode().replace("\r\n", "\n"))
    except OSError as error:
        raise InvalidInput(f"{path} must be a readable file, got {error.strerror or error}") from None
    except InvalidInput:
        raise
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, a number too long, nested too deep
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
    try:
        known = path.suffix == ".toml" or path.exists()
    except OSError:  # a name too long for the file system
        known = False
    if not known:
        raise InvalidInput(f"scene must be a TOML file or one of {', '.join(names())}, got {str(source)!r}")
    return path
