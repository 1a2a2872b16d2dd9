"""The one door for files that somebody else has written: regular files of a limited size, text of limited depth."""

from __future__ import annotations

import json
import os
import re
import stat
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from scenes.errors import InvalidInput

MOST_TEXT = 1 << 20  # bytes of a scene, a campaign or a lens
MOST_RESULT = 64 << 20  # bytes of a result.json: some 20,000 settings
MOST_TABLE = 16 << 20  # bytes of a catalogue: some 30,000 parts
MOST_DEPTH = 32  # tables and lists in each other
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MOST_DEPTH}}}", re.ASCII)
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOCTTY", 0)
_KINDS = {
    stat.S_IFIFO: "a named pipe", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device", stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a directory",
}  # fmt: skip


class Unreadable(InvalidInput):
    """A file that cannot be read at all, or is none; ``reason`` says why."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path} must be a readable file, got {reason}")
        self.reason = reason


@contextmanager
def opened(path: Path, most: int) -> Iterator[tuple[BinaryIO, int]]:
    """A regular file, open to be read, and its size.

    Nothing waits: a named pipe without a writer, a device or a directory is refused, also behind a link.

    Parameters
    ----------
    path : Path
    most : int
        Bytes that it may have.

    Raises
    ------
    InvalidInput
        If it cannot be opened or is no regular file (`Unreadable`), or is larger.
    """
    try:
        number = os.open(path, _FLAGS)
    except OSError as error:
        raise Unreadable(path, error.strerror or str(error)) from None
    except ValueError:
        raise Unreadable(path, "a null character in its name") from None
    with os.fdopen(number, "rb", closefd=True) if _is_file(number) else _refused(number, path) as file:
        size = os.fstat(number).st_size
        if size > most:
            raise InvalidInput(f"{path} must be at most {most} bytes long, got more")
        yield file, size


def _is_file(number: int) -> bool:
    return stat.S_ISREG(os.fstat(number).st_mode)


def _refused(number: int, path: Path) -> Any:
    kind = stat.S_IFMT(os.fstat(number).st_mode)
    os.close(number)
    raise Unreadable(path, _KINDS.get(kind, "something else"))


def read_bytes(path: Path, most: int) -> bytes:
    """What a file holds; errors as of `opened`."""
    with opened(path, most) as (file, _):
        try:
            data = file.read(most + 1)  # it may be growing
        except OSError as error:
            raise Unreadable(path, error.strerror or str(error)) from None
    if len(data) > most:
        raise InvalidInput(f"{path} must be at most {most} bytes long, got more")
    return data


def read_toml(path: Path, most: int = MOST_TEXT) -> dict[str, Any]:
    """The document of a TOML file of at most so many bytes.

    Raises
    ------
    InvalidInput
        As of `opened`; if it is no TOML in UTF-8, or holds what is nested more than `MOST_DEPTH` deep, a whole number
        of more than 64 bits, or a key of more parts.
    """
    return _document(path, most, "TOML", _toml)


def read_json(path: Path) -> Any:
    """The document of a JSON file; limits as of `read_toml`, for a result of many settings."""
    return _document(path, MOST_RESULT, "JSON", json.loads)


def _toml(text: str) -> dict[str, Any]:
    if _DEEP_KEY.search(text):  # the parser needs the square of their number, in time and in memory
        raise ValueError(f"a key of more than {MOST_DEPTH} parts")
    return tomllib.loads(text.replace("\r\n", "\n"))


def _document(path: Path, most: int, language: str, parse: Callable[[str], Any]) -> Any:
    try:
        document = parse(read_bytes(path, most).decode())
        check_bounded(document)
        return document
    except InvalidInput:
        raise
    except RecursionError:
        reason = f"more than {MOST_DEPTH} levels"
    except ValueError as error:  # no TOML, no UTF-8, a number too long
        reason = (str(error).splitlines() or ["nothing"])[0]
    raise InvalidInput(f"{path} must be valid {language}, got {reason}")


def check_bounded(document: Any) -> None:
    """Raise ValueError if a document of tables and lists is nested too deep or holds a whole number of over 64 bits."""
    level = [document]
    for _ in range(MOST_DEPTH + 1):
        for item in level:
            if isinstance(item, int) and not -(1 << 63) <= item < 1 << 63:
                raise ValueError(f"a whole number of {len(str(abs(item)))} digits")
        level = [inner for item in level for inner in _inside(item)]
        if not level:
            return
    raise ValueError(f"more than {MOST_DEPTH} levels")


def _inside(item: Any) -> Any:
    return item.values() if isinstance(item, dict) else item if isinstance(item, list) else ()
