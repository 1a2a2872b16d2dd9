"""A catalogue: sensors, lenses and lights that can be bought, from a TOML or CSV file."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from scenes.catalogue import emva1288
from scenes.catalogue.entry import Contradiction, Entry
from scenes.catalogue.lens import ListedLens
from scenes.catalogue.light import ListedLight
from scenes.catalogue.sensor import ListedSensor
from scenes.errors import InvalidInput, describe, given
from scenes.files.door import MOST_TABLE, read_bytes, read_toml
from scenes.model import Model, Title

SAMPLE = "sample"
_BUNDLED = Path(__file__).parent / "sample.toml"
_KINDS: tuple[type[Entry], ...] = (ListedSensor, ListedLens, ListedLight)
_MOST = 100_000  # entries of a table
_LISTS = ("mount", "for_diagonals_mm")
_PAIR = re.compile(r"\s*(\S+)\s*[xX]\s*(\S+)\s*")


class Catalogue(Model):
    """What can be bought.

    Examples
    --------
    >>> found = load("sample")
    >>> found.is_sample, found.find("sensors", "Allied Vision Alvium 1800 C-507m").resolution
    (True, (2464, 2056))
    """

    title: Title = ""
    """What it is about."""
    is_sample: bool = False
    """Whether it is no offer of anybody, but some parts to try things out with."""
    currency: Title = ""
    """Of the prices."""
    sensors: tuple[ListedSensor, ...] = ()
    """Cameras."""
    lenses: tuple[ListedLens, ...] = ()
    """Lenses."""
    lights: tuple[ListedLight, ...] = ()
    """Lights."""

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All of them."""
        return (*self.sensors, *self.lenses, *self.lights)

    @property
    def priced(self) -> bool:
        """Whether any entry has a price: what has none then is no offer."""
        return any(each.price is not None for each in self.entries)

    def find(self, table: str, name: str) -> Entry:
        """The entry of a name.

        Raises
        ------
        InvalidInput
            If there is none.
        """
        for each in getattr(self, table):
            if each.name == name:
                return each
        raise InvalidInput(f"name must be one of {table}, got {given(name)}")

    def contradictions(self) -> tuple[Contradiction, ...]:
        """Of all entries, in their order; names that stand twice, too."""
        found = [each for entry in self.entries for each in entry.contradictions()]
        for kind in _KINDS:
            names = Counter(each.name for each in getattr(self, kind.table))
            found += [
                Contradiction(f'{kind.table} "{name}"', ("name",), f"name must be of one entry, got {count} of it")
                for name, count in names.items()
                if count > 1
            ]
        return tuple(found)


def find(source: str | Path) -> Path:
    """Path of a catalogue's file: of one's own, or of the bundled sample."""
    return _BUNDLED if str(source) == SAMPLE else Path(source)


def load(source: str | Path) -> Catalogue:
    """Read a catalogue.

    Parameters
    ----------
    source : str or Path
        ``sample``, which is bundled, or the path of a TOML or CSV file.

    Raises
    ------
    InvalidInput
        If it cannot be read, or an entry has an unknown key or a value of the wrong kind; the text names file, entry
        and key. What is contradictory can be read: `Catalogue.contradictions`.
    """
    path = find(source)
    document = _of_csv(path) if path.suffix.lower() == ".csv" else read_toml(path, MOST_TABLE)
    tables = {kind.table: _entries(path, kind, document.get(kind.table, [])) for kind in _KINDS}
    try:
        found = Catalogue.model_validate({**document, **tables})
    except ValidationError as error:
        raise InvalidInput(f"{path}: {describe(error)}") from None
    if not found.entries:
        raise InvalidInput(f"{path} must have sensors, lenses or lights, got none")
    return found


def _entries(path: Path, kind: type[Entry], rows: Any) -> list[Entry]:
    if not isinstance(rows, list) or len(rows) > _MOST:
        got = f"{len(rows)} of them" if isinstance(rows, list) else given(rows)[:80]
        raise InvalidInput(f"{path}: {kind.table} must be a list of at most {_MOST} tables, got {got}")
    return [_entry(path, kind, i, row) for i, row in enumerate(rows)]


def _entry(path: Path, kind: type[Entry], number: int, row: Any) -> Entry:
    name = row.get("name") if isinstance(row, dict) else None
    where = f"{path}: {kind.table}[{number}]" + (f' "{name}"' if isinstance(name, str) else "")
    if isinstance(row, dict) and isinstance(row.get("emva1288"), str):
        row = {**emva1288.read(path.parent / row["emva1288"]), **row}
    try:
        return kind.model_validate(row)
    except ValidationError as error:
        raise InvalidInput(f"{where}: {describe(error)}") from None


def _of_csv(path: Path) -> dict[str, Any]:
    """A document from rows: the column ``table`` says of what, an empty cell nothing; pairs are written 5 x 7."""
    try:
        text = read_bytes(path, MOST_TABLE).decode("utf-8-sig")
        rows = list(csv.DictReader(io.StringIO(text), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidInput(f"{path} must be valid CSV in UTF-8, got {error}") from None
    document: dict[str, Any] = {kind.table: [] for kind in _KINDS}
    for number, row in enumerate(rows):
        table = row.pop("table", None)
        if table not in document:
            raise InvalidInput(f"{path}: table must be one of {', '.join(document)} in row {number + 1}, got {table!r}")
        if None in row or None in row.values():
            raise InvalidInput(f"{path}: row {number + 1} must have as many cells as the first line, got others")
        document[table].append({key: _cell(key, cell.strip()) for key, cell in row.items() if cell.strip()})
    return document


def _cell(key: str, text: str) -> Any:
    if key in _LISTS:
        return [_value(part.strip()) for part in text.split(";")]
    pair = _PAIR.fullmatch(text)
    values = [_value(part) for part in pair.groups()] if pair else []
    return values if values and all(isinstance(each, int | float) for each in values) else _value(text)


def _value(text: str) -> Any:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return {"true": True, "false": False}.get(text.lower(), text)
