"""The run file: one SQLite database that holds everything a run has found, committed piece by piece."""

from __future__ import annotations

import itertools
import json
import sqlite3
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from scenes import InvalidInput
from scenes import status as statuses
from scenes.errors import describe, one_line
from validation.batch import facts
from validation.batch.campaign import Campaign
from validation.batch.part_files import by_content, contents
from validation.batch.shard import Shard
from validation.batch.stopped import Stopped
from validation.batch.work import CHUNK, Chunk, Clean, Packed, TaskResult

_TABLES = {
    "run": "key TEXT PRIMARY KEY, value TEXT NOT NULL",
    "setting": "setting INTEGER PRIMARY KEY, height INTEGER, width INTEGER, image BLOB, predicted TEXT, seconds TEXT, "
    "trouble TEXT",
    "propagated": "setting INTEGER, method TEXT, variance_px2 REAL, value_px REAL, status TEXT, "
    "PRIMARY KEY (setting, method)",
    "chunk": "setting INTEGER, chunk INTEGER, count INTEGER, seconds TEXT, PRIMARY KEY (setting, chunk)",
    "distance": "setting INTEGER, chunk INTEGER, method TEXT, values_px BLOB, PRIMARY KEY (setting, chunk, method)",
    "failure": "setting INTEGER, chunk INTEGER, method TEXT, image INTEGER, count INTEGER, status TEXT, "
    "PRIMARY KEY (setting, chunk, method, image)",
}
_APPLICATION, _VERSION = 0x49434552, 2  # "ICER", in the file's header; the version counts changes of the tables
_SCHEMA = "\n".join([
    "BEGIN IMMEDIATE;", *(f"CREATE TABLE {name} ({columns});" for name, columns in _TABLES.items()),
    f"PRAGMA application_id = {_APPLICATION};", f"PRAGMA user_version = {_VERSION};", "COMMIT;",
])  # fmt: skip
_LARGEST = 512 << 20  # bytes of a value in the file
_FARTHEST = 1e12  # px; of a distance
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
        self.path, self._what = directory / "run.sqlite", "--out must be a writable directory"
        try:
            directory.mkdir(parents=True, exist_ok=True)
            self._check_files()
            self._lock = _lock(directory)
            if fresh:
                for file in (self.path, *directory.glob("run.sqlite-*")):
                    file.unlink(missing_ok=True)
            self._db = sqlite3.connect(self.path, timeout=BUSY_S)
            self._db.execute("PRAGMA journal_mode = WAL")
            self._db.execute("PRAGMA synchronous = FULL")
            if not self._db.execute("SELECT 1 FROM sqlite_master LIMIT 1").fetchone():
                self._db.executescript(_SCHEMA)
        except (OSError, sqlite3.Error) as error:
            raise InvalidInput(f"{self._what}, got {directory} ({error})") from None
        self._check()
        try:
            self._claim(directory, identity)
        except InvalidInput:
            self.close()
            raise

    @classmethod
    def reopen(cls, directory: Path) -> RunFile:
        """The run file of a directory, to read, also while a run is writing it; nothing in it is trusted.

        Raises
        ------
        InvalidInput
            If there is none, or it is damaged or of another version. So does every method that reads, where what it
            reads is not what is written there.
        """
        store = cls.__new__(cls)
        store.path, store._lock = directory / "run.sqlite", None
        store._what = "DIR must be a run directory of `ice validate`"
        store._check_files()
        try:
            store._db = sqlite3.connect(f"{store.path.absolute().as_uri()}?mode=ro", uri=True, timeout=BUSY_S)
        except (sqlite3.Error, ValueError) as error:
            raise InvalidInput(f"{store._what}, got {directory} ({error})") from None
        store._check()
        return store

    def _check_files(self) -> None:
        """All of SQLite's files are files: a named pipe would be waited for."""
        try:
            odd = [file for file in self.path.parent.glob("run.*") if file.exists() and not file.is_file()]
        except (OSError, ValueError) as error:
            raise InvalidInput(f"{self._what}, got {self.path.parent} ({error})") from None
        if odd:
            raise InvalidInput(f"{self._what}, got {self.path.parent} ({odd[0].name} is no file)")

    def _check(self) -> None:
        """The file is whole, and its tables are those of this version."""
        try:
            self._db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LARGEST)
            self._db.execute("PRAGMA trusted_schema = OFF")
            self._db.execute("PRAGMA cell_size_check = ON")
            made = tuple(
                self._db.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version")
            )
            found = dict(self._db.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL"))
            whole = self._db.execute("PRAGMA quick_check(1)").fetchone()[0]
        except (sqlite3.Error, UnicodeDecodeError, ValueError, MemoryError) as error:
            self.close()
            raise InvalidInput(f"{self._what}, got {self.path.parent} ({error})") from None
        reason = "" if whole == "ok" else f"damaged: {whole}"
        if found != {name: f"CREATE TABLE {name} ({columns})" for name, columns in _TABLES.items()}:
            reason = "run.sqlite has other tables"
        if made != (_APPLICATION, _VERSION):
            reason = f"run.sqlite is of version {made[1]}, not {_VERSION}; --fresh starts anew"
        if reason:
            self.close()
            raise InvalidInput(f"{self._what}, got {self.path.parent} ({reason})")

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
        rows = self._rows("SELECT value FROM run WHERE key = ?", key)
        return next((self._document(key, text) for (text,) in rows), default)

    def identity(self) -> dict[str, Any]:
        """What the run's numbers depend on."""
        found = self.fact("identity")
        if found is None:
            raise self._damaged("it does not say which run it is")
        return found

    def campaign(self) -> Campaign:
        """The campaign that the run works through; its parts' files are found from where the run was started.

        Raises
        ------
        InvalidInput
            If one of them no longer holds what was measured.
        """
        directory, identity = Path(self.fact("directory", "")), self.identity()
        for name, now in contents(identity["campaign"], directory).items():
            if now and now != identity.get("files", {}).get(name, now):
                raise InvalidInput(f"{directory / name} must hold what {self.path.parent} measured, got other content")
        try:
            return Campaign.model_validate(identity["campaign"], context={"directory": directory})
        except ValidationError as error:
            raise self._damaged(f"its campaign: {describe(error)}") from None

    def add(self, setting: int, found: TaskResult) -> None:
        """Commit all that a task found, or nothing."""
        with self._transaction():
            if found.clean:
                self._add_clean(setting, found.clean)
            if found.trouble:
                row = setting, found.trouble
                self._db.execute("INSERT OR REPLACE INTO setting (setting, trouble) VALUES (?, ?)", row)
            for number, chunk in found.chunks.items():
                self._add_chunk(setting, number, chunk)

    def take(self, other: RunFile) -> None:
        """Commit all that another file of the same run holds of settings that this one has nothing of.

        Raises
        ------
        InvalidInput
            If the other file is of another run, or both hold the same setting.
        """
        if texts := list(itertools.islice(_differences(by_content(self.identity()), by_content(other.identity())), 3)):
            raise InvalidInput(f"{other.path} must be of the same run as {self.path}, got one where {', '.join(texts)}")
        both = self._begun() & other._begun()
        if both:
            raise InvalidInput(f"{other.path} must hold other settings than {self.path}, got {min(both)} in both")
        with self._transaction():
            for name in _TABLES.keys() - {"run"}:
                for row in other._each(f"SELECT * FROM {name}"):
                    self._db.execute(f"INSERT INTO {name} VALUES ({', '.join('?' * len(row))})", row)

    def _begun(self) -> set[int]:
        """Settings of which anything is known."""
        return {setting for (setting,) in self._rows("SELECT setting FROM setting UNION SELECT setting FROM chunk")}

    def drop_image(self, setting: int) -> None:
        """Give up the image of a finished setting, so that a long campaign's file stays small."""
        with self._transaction():
            self._db.execute("UPDATE setting SET image = NULL WHERE setting = ?", (setting,))

    def packed(self, setting: int) -> Packed | None:
        """Noise-free image of a setting, or None if it is not rendered or not kept."""
        query = "SELECT height, width, image FROM setting WHERE setting = ? AND image IS NOT NULL"
        rows = self._rows(query, setting)
        if not rows:
            return None
        (packed,) = (Packed(*row) for row in rows)
        if not (isinstance(packed.data, bytes) and packed.fits()):
            raise self._damaged(f"the image of setting {setting} has no size")
        return packed

    def has_image(self, setting: int) -> bool:
        """Whether there is one."""
        return bool(self._rows("SELECT 1 FROM setting WHERE setting = ? AND image IS NOT NULL", setting))

    def image(self, setting: int) -> np.ndarray | None:
        """The same as an array, grey levels."""
        packed = self.packed(setting)
        try:
            return packed and packed.array()
        except (ValueError, zlib.error) as error:
            raise self._damaged(f"the image of setting {setting}: {error}") from None

    def chunks(self, setting: int) -> dict[int, int]:
        """The finished chunks of a setting, with their number of images."""
        rows = self._rows("SELECT chunk, count FROM chunk WHERE setting = ?", setting)
        if not all(isinstance(chunk, int) and isinstance(n, int) and 0 < n <= CHUNK for chunk, n in rows):
            raise self._damaged(f"the chunks of setting {setting}")
        return dict(rows)

    def images(self, shard: Shard = Shard()) -> int:
        """Number of images measured so far, in the settings of a shard."""
        query = "SELECT COALESCE(SUM(count), 0) FROM chunk WHERE setting % ? = ?"
        (found,) = self._rows(query, shard.of, shard.number - 1)[0]
        if not (isinstance(found, int) and found >= 0):
            raise self._damaged("the number of images")
        return found

    def predicted(self, setting: int) -> dict[str, float] | None:
        """Predictions that need no image, as `work.Clean.predicted`; None if there are none yet."""
        rows = self._rows("SELECT predicted FROM setting WHERE setting = ? AND predicted IS NOT NULL", setting)
        return next((self._document("predicted", text) for (text,) in rows), None)

    def trouble(self, setting: int) -> str | None:
        """Why a setting cannot be worked on, in one line."""
        rows = self._rows("SELECT trouble FROM setting WHERE setting = ? AND trouble IS NOT NULL", setting)
        return next((one_line(str(trouble)) for (trouble,) in rows), None)

    def propagated(self, setting: int, method: str) -> tuple[float, float, str]:
        """Variance (px^2), distance in the noise-free image (px) and status, as predicted from the image."""
        query = "SELECT variance_px2, value_px, status FROM propagated WHERE setting = ? AND method = ?"
        rows = self._rows(query, setting, method)
        if not rows:
            raise self._damaged(f"no prediction of setting {setting} by {method}")
        ((variance, value, status),) = rows
        value = float("nan") if value is None else value
        if not (isinstance(variance, float) and variance >= 0 and isinstance(value, float) and status in statuses.ALL):
            raise self._damaged(f"the prediction of setting {setting} by {method}")
        return variance, value, status

    def distances(self, setting: int, method: str) -> np.ndarray:
        """All distances measured so far in the order of the images, px; NaN for failed ones."""
        query = "SELECT chunk, values_px FROM distance WHERE setting = ? AND method = ? ORDER BY chunk"
        rows, sizes = self._rows(query, setting, method), self.chunks(setting)
        if {chunk: isinstance(data, bytes) and len(data) for chunk, data in rows} != {
            c: 8 * n for c, n in sizes.items()
        }:
            raise self._damaged(f"the distances of setting {setting} by {method}")
        values = np.concatenate([np.empty(0), *(np.frombuffer(data, "<f8") for _, data in rows)])
        if not (np.isnan(values) | (np.abs(values) <= _FARTHEST)).all():
            raise self._damaged(f"the distances of setting {setting} by {method}")
        return values

    def failures(self, setting: int, method: str) -> dict[str, int]:
        """How many images failed, by status."""
        query = "SELECT status, SUM(count) FROM failure WHERE setting = ? AND method = ? GROUP BY status"
        found = dict(self._rows(query, setting, method))
        if not all(status in statuses.ALL and isinstance(n, int) and n > 0 for status, n in found.items()):
            raise self._damaged(f"the failures of setting {setting} by {method}")
        return found

    def seconds(self) -> dict[str, float]:
        """Working time of all workers by what it was spent on."""
        total: dict[str, float] = {}
        query = "SELECT seconds FROM setting WHERE seconds IS NOT NULL UNION ALL SELECT seconds FROM chunk"
        for (text,) in self._each(query):
            for name, value in self._document("seconds", text).items():
                total[name] = total.get(name, 0.0) + value
        return total

    def _rows(self, query: str, *values: Any) -> list[tuple]:
        return list(self._each(query, *values))

    def _each(self, query: str, *values: Any) -> Iterator[tuple]:
        """One at a time: of a large run they are many."""
        try:
            yield from self._db.execute(query, values)
        except (sqlite3.Error, UnicodeDecodeError, OverflowError, MemoryError) as error:
            raise self._damaged(str(error)) from None

    def _document(self, kind: str, text: Any) -> Any:
        try:
            return facts.read(kind, text)
        except ValueError as error:
            raise self._damaged(str(error)) from None

    def _damaged(self, what: str) -> InvalidInput:
        return InvalidInput(f"{self.path} must be an undamaged run file, got one where this is wrong: {what}")

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
        if there is None and self._rows("SELECT 1 FROM setting UNION ALL SELECT 1 FROM chunk LIMIT 1"):
            raise InvalidInput(
                f"--out must be a new directory or hold this run, got {directory}, which does not say which run it "
                "holds (--fresh starts anew)"
            )
        if there is None:
            self.note("identity", identity)
            self.note("directory", str(Path.cwd()))
        elif texts := list(itertools.islice(_differences(by_content(there), by_content(identity)), 3)):
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
        except sqlite3.DatabaseError as error:
            raise self._damaged(str(error)) from None


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
