"""Run directories that somebody else has written to."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import zlib
from pathlib import Path

import numpy as np

from scenes import InvalidInput
from tests.hard.fuzzing.documents import changed
from tests.hard.fuzzing.mutations import spoilt
from validation.batch.result import collect
from validation.batch.store import RunFile

_COLUMNS = {
    "run": ("key", "value"),
    "setting": ("setting", "height", "width", "image", "predicted", "seconds", "trouble"),
    "propagated": ("setting", "method", "variance_px2", "value_px", "status"),
    "chunk": ("setting", "chunk", "count", "seconds"),
    "distance": ("setting", "chunk", "method", "values_px"),
    "failure": ("setting", "chunk", "method", "image", "count", "status"),
}
_VALUES = (
    None, -1, 0, 1e308, float("inf"), 2**62, "", "x", "{}", "[]", "nul", "[" * 9000, "9" * 5000, b"", b"\xff" * 9, "\0",
    zlib.compress(bytes(10_000_000)), '{"wall": 1}', "NaN", '{"a": "b"}', "ok", "=1", "é",
)  # fmt: skip


def directory(rng: np.random.Generator, folder: Path, run: Path) -> str:
    """A finished run's directory, damaged, then read as ``ice report`` and ``ice validate`` read it."""
    copy = folder / "damaged"
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir()
    shutil.copy(run / "run.sqlite", copy / "run.sqlite")
    rng.choice([_bytes, _bytes, _row, _row, _row, _row, _document, _document, _schema, _file])(rng, copy)
    if rng.random() < 0.2:
        return _continued(copy, run)
    store = RunFile.reopen(copy)
    try:
        campaign = store.campaign()
        found = collect(campaign, store)
        for row in found.rows:
            store.image(row.index)
        json.dumps(found.to_json(), allow_nan=False)
    finally:
        store.close()
    return "read"


def _continued(copy: Path, run: Path) -> str:
    """As ``ice validate`` takes a directory for its own."""
    whole = RunFile.reopen(run)
    identity = whole.identity()
    whole.close()
    store = RunFile(copy, identity)
    try:
        campaign = store.campaign()
        for index in range(len(campaign)):
            store.chunks(index)
            store.trouble(index)
            store.packed(index)
        store.fact("stages", [])
    finally:
        store.close()
    return "continued"


def _bytes(rng: np.random.Generator, copy: Path) -> None:
    path = copy / "run.sqlite"
    path.write_bytes(spoilt(rng, path.read_bytes()))


def _row(rng: np.random.Generator, copy: Path) -> None:
    """A value set, rows deleted, or a row doubled under another key."""
    table = str(rng.choice(list(_COLUMNS)))
    column = str(rng.choice(_COLUMNS[table]))
    _execute(
        copy,
        f"DELETE FROM {table}" if rng.random() < 0.15 else f"UPDATE OR REPLACE {table} SET {column} = ?",
        _VALUES[rng.integers(len(_VALUES))],
    )


def _document(rng: np.random.Generator, copy: Path) -> None:
    """A value changed in one of the JSON documents."""
    table, column, which = (
        ("run", "value", "key = 'identity'"), ("run", "value", "key = 'wall'"), ("run", "value", "key = 'effects'"),
        ("run", "value", "key = 'machines'"), ("setting", "predicted", "1"), ("chunk", "seconds", "1"),
    )[rng.integers(6)]  # fmt: skip
    db = sqlite3.connect(copy / "run.sqlite")
    (text,) = db.execute(f"SELECT {column} FROM {table} WHERE {which}").fetchone()
    db.close()
    document = json.loads(text)
    new = json.dumps(changed(rng, document)) if isinstance(document, dict) else "[1]"
    _execute(copy, f"UPDATE {table} SET {column} = ? WHERE {which}", new)


def _schema(rng: np.random.Generator, copy: Path) -> None:
    """Tables lost, renamed, made views or triggers; another version."""
    table = str(rng.choice(list(_COLUMNS)))
    statements = (
        f"DROP TABLE {table}", f"ALTER TABLE {table} RENAME TO other", "PRAGMA user_version = 1",
        "PRAGMA application_id = 0",
        f"ALTER TABLE {table} ADD COLUMN more", "CREATE TRIGGER t AFTER INSERT ON run BEGIN DELETE FROM chunk; END",
        f"DROP TABLE {table}; CREATE VIEW {table} AS SELECT 1", "CREATE TABLE more (a)",
    )  # fmt: skip
    db = sqlite3.connect(copy / "run.sqlite")
    db.executescript(str(rng.choice(statements)))
    db.close()


def _file(rng: np.random.Generator, copy: Path) -> None:
    """No file, another file, or something that is none."""
    path, what = copy / "run.sqlite", rng.integers(6)
    path.unlink()
    if what == 0:
        os.mkfifo(path)
    elif what == 1:
        path.symlink_to("/dev/zero")
    elif what == 2:
        path.mkdir()
    elif what == 3:
        path.write_bytes(rng.bytes(5000))
    elif what == 4:
        path.write_bytes(b"")


def _execute(copy: Path, statement: str, value: object) -> None:
    db = sqlite3.connect(copy / "run.sqlite")
    try:
        with db:
            db.execute(statement, (value,) if "?" in statement else ())
    except (sqlite3.Error, OverflowError):  # the constraint holds
        raise InvalidInput("the damage must be possible, got none") from None
    finally:
        db.close()
