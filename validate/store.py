"""The run file: one SQLite database that holds everything a run has found, committed piece by piece."""

from __future__ import annotations

import json
import sqlite3
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from scenes import InvalidInput
from validate.work import Chunk, Clean

_SCHEMA = """
CREATE TABLE IF NOT EXISTS run (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS clean (
    setting INTEGER PRIMARY KEY, height INTEGER, width INTEGER, image BLOB, seconds TEXT);
CREATE TABLE IF NOT EXISTS propagated (
    setting INTEGER, method TEXT, variance_px2 REAL, value_px REAL, status TEXT, PRIMARY KEY (setting, method));
CREATE TABLE IF NOT EXISTS chunk (
    setting INTEGER, chunk INTEGER, count INTEGER, seconds TEXT, PRIMARY KEY (setting, chunk));
CREATE TABLE IF NOT EXISTS distance (
    setting INTEGER, chunk INTEGER, method TEXT, values_px BLOB, PRIMARY KEY (setting, chunk, method));
CREATE TABLE IF NOT EXISTS failure (
    setting INTEGER, chunk INTEGER, method TEXT, image INTEGER, status TEXT,
    PRIMARY KEY (setting, chunk, method, image));
"""


class RunFile:
    """A run's results on disk; every write is one transaction.

    Images are zlib-compressed, distances plain, both little-endian float64; a failed measurement is NaN among the
    distances and a row of ``failure``.

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
        If the directory cannot be written or belongs to another run.
    """

    def __init__(self, directory: Path, identity: dict[str, Any], fresh: bool = False) -> None:
        self.path = directory / "run.sqlite"
        try:
            directory.mkdir(parents=True, exist_ok=True)
            if fresh:
                for file in (self.path, *directory.glob("run.sqlite-*")):
                    file.unlink(missing_ok=True)
            self._db = sqlite3.connect(self.path)
            self._db.executescript(_SCHEMA)
        except (OSError, sqlite3.Error) as error:
            raise InvalidInput(f"--out must be a writable directory, got {directory} ({error})") from None
        self._claim(directory, identity)

    @classmethod
    def reopen(cls, directory: Path) -> RunFile:
        """The run file of a directory, to read."""
        store = cls.__new__(cls)
        store.path = directory / "run.sqlite"
        store._db = sqlite3.connect(f"file:{store.path}?mode=ro", uri=True)
        return store

    def close(self) -> None:
        self._db.close()

    def note(self, key: str, value: Any) -> None:
        """Record a fact about the run."""
        with self._db:
            self._db.execute("INSERT OR REPLACE INTO run VALUES (?, ?)", (key, json.dumps(value)))

    def add_clean(self, setting: int, clean: Clean) -> None:
        with self._db:
            image = zlib.compress(clean.image.astype("<f8").tobytes(), 1)
            row = (setting, *clean.image.shape, image, json.dumps(clean.seconds))
            self._db.execute("INSERT OR REPLACE INTO clean VALUES (?, ?, ?, ?, ?)", row)
            rows = [(setting, method, *found) for method, found in clean.propagated.items()]
            self._db.executemany("INSERT OR REPLACE INTO propagated VALUES (?, ?, ?, ?, ?)", rows)

    def add_chunk(self, setting: int, chunk: int, count: int, found: Chunk) -> None:
        with self._db:
            self._db.execute(
                "INSERT INTO chunk VALUES (?, ?, ?, ?)", (setting, chunk, count, json.dumps(found.seconds))
            )
            for method, values in found.distances.items():
                self._db.execute(
                    "INSERT INTO distance VALUES (?, ?, ?, ?)", (setting, chunk, method, values.astype("<f8").tobytes())
                )
            rows = [
                (setting, chunk, m, i, status) for m, images in found.failures.items() for i, status in images.items()
            ]
            self._db.executemany("INSERT INTO failure VALUES (?, ?, ?, ?, ?)", rows)

    def image(self, setting: int) -> np.ndarray | None:
        """Noise-free image of a setting, or None while it is not rendered."""
        row = self._db.execute("SELECT height, width, image FROM clean WHERE setting = ?", (setting,)).fetchone()
        return None if row is None else np.frombuffer(zlib.decompress(row[2]), "<f8").reshape(row[:2])

    def chunks(self) -> dict[tuple[int, int], int]:
        """(setting, chunk) of the finished chunks, with their number of images."""
        return {(s, c): n for s, c, n in self._db.execute("SELECT setting, chunk, count FROM chunk")}

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
        query = "SELECT status, COUNT(*) FROM failure WHERE setting = ? AND method = ? GROUP BY status"
        return dict(self._db.execute(query, (setting, method)).fetchall())

    def seconds(self) -> dict[str, float]:
        """Working time of all workers by what it was spent on."""
        total: dict[str, float] = {}
        for (text,) in self._db.execute("SELECT seconds FROM clean UNION ALL SELECT seconds FROM chunk"):
            for name, value in json.loads(text).items():
                total[name] = total.get(name, 0.0) + value
        return total

    def _claim(self, directory: Path, identity: dict[str, Any]) -> None:
        text = json.dumps(identity, sort_keys=True)
        row = self._db.execute("SELECT value FROM run WHERE key = 'identity'").fetchone()
        if row is None:
            self.note("identity", identity)
        elif json.dumps(json.loads(row[0]), sort_keys=True) != text:
            stored = json.loads(row[0])
            different = [key for key in identity if stored.get(key) != identity[key]]
            self.close()
            raise InvalidInput(
                f"--out must be a new directory or hold this run, got {directory}, whose {' and '.join(different)} "
                "differ (--fresh starts anew)"
            )
