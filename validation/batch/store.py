"""The run file: one SQLite database that holds everything a run has found, committed piece by piece."""

from __future__ import annotations

import itertools
import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from scenes import InvalidInput
from validation.batch.stopped import Stopped
from validation.batch.work import Chunk, Clean, Found, Packed

_SCHEMA = """
BEGIN IMMEDIATE;
CREATE TABLE IF NOT EXISTS run (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS setting (
    setting INTEGER PRIMARY KEY, height INTEGER, width INTEGER, image BLOB, predicted TEXT, seconds TEXT, trouble TEXT);
CREATE TABLE IF NOT EXISTS propagated (
    setting INTEGER, method TEXT, variance_px2 REAL, value_px REAL, status TEXT, PRIMARY KEY (setting, method));
CREATE TABLE IF NOT EXISTS chunk (
    setting INTEGER, chunk INTEGER, count INTEGER, seconds TEXT, PRIMARY KEY (setting, chunk));
CREATE TABLE IF NOT EXISTS distance (
    setting INTEGER, chunk INTEGER, method TEXT, values_px BLOB, PRIMARY KEY (setting, chunk, method));
CREATE TABLE IF NOT EXISTS failure (
    setting INTEGER, chunk INTEGER, method TEXT, image INTEGER, count INTEGER, status TEXT,
    PRIMARY KEY (setting, chunk, method, image));
COMMIT;
"""
BUSY_S = 30.0  # how long a lock of another process is waited for


class RunFile:
    """A run's results on disk; every write is one transaction, in SQLite's write-ahead log.

    Images are zlib-compressed, distances plain, both little-endian float64. A failed measurement is NaN among the
    distances and told of in ``failure``: one row for images of a chunk that failed in the same way one after another.

    Parameters
    ----------
    directory : Path
        Made if it is not there.
    identity : dict
        What the numbers depend on. A directory that holds a run of another identity is refused.
    fresh : bool
        Throw away what is there.

    Raises
    ------
    InvalidInput
        If the directory cannot be written, is in use, or belongs to another run.
    Stopped
        By every method that writes: if the disk is full, or another process keeps the file locked.
    """

    def __init__(self, directory: Path, identity: dict[str, Any], fresh: bool = False) -> None:
        self.path = directory / "run.sqlite"
        try:
            directory.mkdir(parents=True, exist_ok=True)
            self._lock = _lock(directory)
            if fresh:
                for file in (self.path, *directory.glob("run.sqlite-*")):
                    file.unlink(missing_ok=True)
            self._db = sqlite3.connect(self.path, timeout=BUSY_S)
            self._db.execute("PRAGMA journal_mode = WAL")
            self._db.execute("PRAGMA synchronous = FULL")
            self._db.executescript(_SCHEMA)
        except (OSError, sqlite3.Error) as error:
            raise InvalidInput(f"--out must be a writable directory, got {directory} ({error})") from None
        self._claim(directory, identity)

    @classmethod
    def reopen(cls, directory: Path) -> RunFile:
        """The run file of a directory, to read, also while a run is writing it."""
        store = cls.__new__(cls)
        store.path, store._lock = directory / "run.sqlite", None
        try:
            store._db = sqlite3.connect(f"file:{store.path}?mode=ro", uri=True, timeout=BUSY_S)
            store._db.execute("SELECT * FROM run JOIN setting LIMIT 1")
        except sqlite3.Error as error:
            raise InvalidInput(f"DIR must be a run directory of `ice validate`, got {directory} ({error})") from None
        return store

    def close(self) -> None:
        self._db.close()
        if self._lock:
            self._lock.close()

    def note(self, key: str, value: Any) -> None:
        """Record a fact about the run."""
        with self._transaction():
            self._db.execute("INSERT OR REPLACE INTO run VALUES (?, ?)", (key, json.dumps(value)))

    def fact(self, key: str, default: Any = None) -> Any:
        """A recorded fact."""
        row = self._db.execute("SELECT value FROM run WHERE key = ?", (key,)).fetchone()
        return default if row is None else json.loads(row[0])

    def add(self, setting: int, found: Found) -> None:
        """Commit all that a task found, or nothing."""
        with self._transaction():
            if found.clean:
                self._add_clean(setting, found.clean)
            if found.trouble:
                row = setting, found.trouble
                self._db.execute("INSERT OR REPLACE INTO setting (setting, trouble) VALUES (?, ?)", row)
            for number, chunk in found.chunks.items():
                self._add_chunk(setting, number, chunk)

    def drop_image(self, setting: int) -> None:
        """Give up the image of a finished setting, so that a long campaign's file stays small."""
        with self._transaction():
            self._db.execute("UPDATE setting SET image = NULL WHERE setting = ?", (setting,))

    def packed(self, setting: int) -> Packed | None:
        """Noise-free image of a setting, or None if it is not rendered or not kept."""
        row = self._db.execute("SELECT height, width, image FROM setting WHERE setting = ?", (setting,)).fetchone()
        return Packed(*row) if row and row[2] is not None else None

    def image(self, setting: int) -> np.ndarray | None:
        """The same as an array, grey levels."""
        packed = self.packed(setting)
        return packed and packed.array()

    def chunks(self, setting: int) -> dict[int, int]:
        """The finished chunks of a setting, with their number of images."""
        return dict(self._db.execute("SELECT chunk, count FROM chunk WHERE setting = ?", (setting,)).fetchall())

    def images(self) -> int:
        """Number of images measured so far."""
        return self._db.execute("SELECT COALESCE(SUM(count), 0) FROM chunk").fetchone()[0]

    def predicted(self, setting: int) -> dict[str, float] | None:
        """Predictions that need no image, as `work.Clean.predicted`; None if there are none yet."""
        row = self._db.execute("SELECT predicted FROM setting WHERE setting = ?", (setting,)).fetchone()
        return json.loads(row[0]) if row and row[0] else None

    def trouble(self, setting: int) -> str | None:
        """Why a setting cannot be worked on."""
        row = self._db.execute("SELECT trouble FROM setting WHERE setting = ?", (setting,)).fetchone()
        return row and row[0]

    def propagated(self, setting: int, method: str) -> tuple[float, float, str]:
        """Variance (px^2), distance in the noise-free image (px) and status, as predicted from the image."""
        query = "SELECT variance_px2, value_px, status FROM propagated WHERE setting = ? AND method = ?"
        variance, value, status = self._db.execute(query, (setting, method)).fetchone()
        return variance, float("nan") if value is None else value, status

    def distances(self, setting: int, method: str) -> np.ndarray:
        """All distances measured so far in the order of the images, px; NaN for failed ones."""
        query = "SELECT values_px FROM distance WHERE setting = ? AND method = ? ORDER BY chunk"
        return np.concatenate(
            [np.empty(0), *(np.frombuffer(row[0], "<f8") for row in self._db.execute(query, (setting, method)))]
        )

    def failures(self, setting: int, method: str) -> dict[str, int]:
        """How many images failed, by status."""
        query = "SELECT status, SUM(count) FROM failure WHERE setting = ? AND method = ? GROUP BY status"
        return dict(self._db.execute(query, (setting, method)).fetchall())

    def seconds(self) -> dict[str, float]:
        """Working time of all workers by what it was spent on."""
        total: dict[str, float] = {}
        query = "SELECT seconds FROM setting WHERE seconds IS NOT NULL UNION ALL SELECT seconds FROM chunk"
        for (text,) in self._db.execute(query):
            for name, value in json.loads(text).items():
                total[name] = total.get(name, 0.0) + value
        return total

    def _add_clean(self, setting: int, clean: Clean) -> None:
        row = setting, *clean.image, json.dumps(clean.predicted), json.dumps(clean.seconds)
        self._db.execute("INSERT OR REPLACE INTO setting VALUES (?, ?, ?, ?, ?, ?, NULL)", row)
        rows = [(setting, method, *found) for method, found in clean.propagated.items()]
        self._db.executemany("INSERT OR REPLACE INTO propagated VALUES (?, ?, ?, ?, ?)", rows)

    def _add_chunk(self, setting: int, number: int, chunk: Chunk) -> None:
        count = max(values.size for values in chunk.distances.values())
        self._db.execute("INSERT INTO chunk VALUES (?, ?, ?, ?)", (setting, number, count, json.dumps(chunk.seconds)))
        rows = [(setting, number, method, v.astype("<f8").tobytes()) for method, v in chunk.distances.items()]
        self._db.executemany("INSERT INTO distance VALUES (?, ?, ?, ?)", rows)
        rows = [(setting, number, m, *run) for m, failed in chunk.failures.items() for run in _runs(failed)]
        self._db.executemany("INSERT INTO failure VALUES (?, ?, ?, ?, ?, ?)", rows)

    def _claim(self, directory: Path, identity: dict[str, Any]) -> None:
        identity, there = json.loads(json.dumps(identity)), self.fact("identity")
        if there is None:
            self.note("identity", identity)
        elif there != identity:
            self.close()
            texts = list(itertools.islice(_differences(there, identity), 3))
            raise InvalidInput(
                f"--out must be a new directory or hold this run, got {directory}, where {', '.join(texts)} "
                "(--fresh starts anew)"
            )

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        try:
            with self._db:
                yield
        except sqlite3.OperationalError as error:
            raise Stopped(f"{self.path} could not be written ({error})") from None


def _lock(directory: Path) -> sqlite3.Connection:
    """An exclusive lock that ends with this process: SQLite's own, on an empty database beside the run file."""
    lock = sqlite3.connect(directory / "run.lock", timeout=0)
    try:
        lock.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as error:
        lock.close()
        if "locked" not in str(error):
            raise
        raise InvalidInput(f"--out must not be in use by another run, got {directory}") from None
    return lock


def _runs(failed: dict[int, str]) -> Iterator[tuple[int, int, str]]:
    """First image, number and status of images that failed in the same way one after another."""
    for (_, status), group in itertools.groupby(
        enumerate(sorted(failed)), key=lambda item: (item[1] - item[0], failed[item[1]])
    ):
        images = [image for _, image in group]
        yield images[0], len(images), status


def _differences(there: Any, here: Any, key: str = "") -> Iterator[str]:
    """What two documents differ in, as "key is ..., not ..."."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in sorted({*there, *here}):
            yield from _differences(there.get(name), here.get(name), f"{key}.{name}".lstrip("."))
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for i, pair in enumerate(zip(there, here, strict=True)):
            yield from _differences(*pair, f"{key}[{i}]")
    elif there != here:
        yield f"{key} is {_short(there)}, not {_short(here)}"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."
