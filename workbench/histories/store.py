"""`histories.sqlite`: the time histories of all runs of a campaign in one file, written by one coordinator.

    axis      times, each row once, however many histories stand on it
    history   of which run, under which name, on which axis, in which unit
    part      CHUNK samples of a history, encoded (see `encoding.py`); number = history * 2^20 + place

It is committed before the rows of its runs are (`runs.sqlite`), with the same care for power loss: a run that
has its answer has its histories, and a history without an answer is written again when its run is. Parts of a
transaction that was cut off are never seen. It is a file of its own so that the record of truth stays small
enough to check, copy and recover.
"""

import sqlite3
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path

import numpy as np

from workbench.errors import StoreError
from workbench.histories.encoding import CHUNK, packed, unpacked
from workbench.models.histories import History
from workbench.system.database import (
    NETWORK,
    connected,
    explained,
    file_system,
    opened_for_reading,
    transaction,
)

__all__ = ["FILE", "Entry", "HistoryStore"]

FILE = "histories.sqlite"
VERSION = 1
PLACES = 20  # bits of the number of a part that count within its history
MOST = CHUNK << PLACES  # samples of a history
AT_ONCE = 500  # parts per statement
PAGE = 8192  # bytes
KNOWN = 1000  # axes whose numbers are remembered

SCHEMA = f"""
CREATE TABLE axis (
  id      INTEGER PRIMARY KEY,
  digest  BLOB NOT NULL UNIQUE,          -- blake2b of its times as doubles, low byte first
  samples INTEGER NOT NULL,
  first   REAL,                          -- the first time and the last
  last    REAL,
  content BLOB NOT NULL                  -- its times as one part
);
CREATE TABLE history (
  id      INTEGER PRIMARY KEY,
  key     TEXT NOT NULL,                 -- of the run
  name    TEXT NOT NULL,                 -- of the response, or as [model] keep says
  axis    INTEGER NOT NULL,
  unit    TEXT NOT NULL,
  UNIQUE (key, name)
);
CREATE INDEX history_name ON history (name);
CREATE TABLE part (
  id      INTEGER PRIMARY KEY,           -- history * 2^20 + place
  content BLOB NOT NULL
);
PRAGMA user_version = {VERSION};
"""


@dataclass(frozen=True, slots=True)
class Entry:
    """A stored history: number, run, name, axis with its samples and both ends, unit, digest of the axis."""

    id: int
    key: str
    name: str
    axis: int
    samples: int
    first: float
    last: float
    unit: str
    digest: bytes

    @property
    def width(self) -> int:
        """Samples per part."""
        return min(CHUNK, self.samples)

    @property
    def seal(self) -> int:
        """Of its first part."""
        return _seal(self.key, self.name, self.digest)


class HistoryStore:
    """The database of histories. Open it with `opened` or `reading`; close it or use it in a `with` block."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._db = connection
        self._axes: dict[bytes, int] = {}

    @classmethod
    def opened(cls, folder: Path) -> "HistoryStore":
        """Open for writing, create when new. Whoever does so has the campaign's `runs.sqlite` open.

        Raises:
            StoreError: it is no database, or of a newer version.
        """
        path = folder / FILE
        db = connected(path)
        try:
            with explained(path):
                db.execute(f"PRAGMA page_size = {PAGE}")
                wal = file_system(folder) not in NETWORK
                db.execute(f"PRAGMA journal_mode = {'WAL' if wal else 'TRUNCATE'}")
                db.execute("PRAGMA synchronous = FULL")
                (version,) = db.execute("PRAGMA user_version").fetchone()
                if version == 0:
                    db.executescript(f"BEGIN IMMEDIATE; {SCHEMA} COMMIT;")
                _check_version(path, version or VERSION)
        except BaseException:
            db.close()
            raise
        return cls(path, db)

    @classmethod
    def reading(cls, folder: Path) -> "HistoryStore | None":
        """Open for reading, beside a writer and without the right to write; None where there is none."""
        path = folder / FILE
        if not path.exists():
            return None
        db, _ = opened_for_reading(path)
        try:
            with explained(path):
                (version,) = db.execute("PRAGMA user_version").fetchone()
            if version == 0:
                db.close()
                return None  # its coordinator was killed before it made the tables
            _check_version(path, version)
        except BaseException:
            db.close()
            raise
        return cls(path, db)

    def __enter__(self) -> "HistoryStore":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the database."""
        self._db.close()

    def write(self, runs: Iterable[tuple[str, Mapping[str, tuple[History, str]]]]) -> None:
        """Write the histories of runs: key, and history and unit by name; those that a run had are replaced.

        Raises:
            StoreError: the disk refuses, or a history is longer than any that fits; nothing is written then.
        """
        with explained(self.path), self._transaction():
            for key, histories in runs:
                self._forget(key)
                digests: dict[int, tuple[bytes, int]] = {}
                for name, (history, unit) in histories.items():
                    times, values = np.asarray(history.time), np.asarray(history.values)
                    if len(values) > MOST or len(values) != len(times):
                        raise StoreError(
                            f"history {name!r} of run {key} has {len(times)} times and {len(values)} values; "
                            f"as many of both are needed, at most {MOST}"
                        )
                    if id(history.time) not in digests:
                        digests[id(history.time)] = self._axis(times)
                    digest, axis = digests[id(history.time)]
                    self._write_one(key, name, axis, unit, packed(values, seal=_seal(key, name, digest)))

    def entries(self, *, name: str | None = None, key: str | None = None) -> list[Entry]:
        """The stored histories, of one name, of one run, in the order in which they were written."""
        where, given = [], []
        for column, value in (("name", name), ("key", key)):
            if value is not None:
                where.append(f"{column} = ?")
                given.append(value)
        query = (
            "SELECT history.id, key, name, axis, samples, first, last, unit, digest "
            "FROM history JOIN axis ON axis.id = history.axis "
            f"WHERE {' AND '.join(where) or '1'} ORDER BY history.id"
        )
        with explained(self.path):
            return [
                Entry(id_, key, name, axis, samples, float(first or 0.0), float(last or 0.0), unit, digest)
                for id_, key, name, axis, samples, first, last, unit, digest in self._db.execute(query, given)
            ]

    def names(self) -> dict[str, int]:
        """The names under which there are histories, and of how many runs."""
        with explained(self.path):
            return dict(self._db.execute("SELECT name, COUNT(*) FROM history GROUP BY name ORDER BY name"))

    def times(self, axis: int) -> np.ndarray:
        """The times of an axis, (samples,).

        Raises:
            StoreError: they are not as they were stored.
        """
        with explained(self.path):
            query = "SELECT digest, samples, content FROM axis WHERE id = ?"
            digest, samples, content = self._db.execute(query, [axis]).fetchone()
        if samples == 0:
            return np.empty(0)
        times = self._unpacked([content], samples, [0], f"axis {axis}")[0]
        if _digest(times) != digest:
            raise self._damaged(f"axis {axis}: its times have another digest")
        return times

    def values(self, entries: Sequence[Entry], begin: int, end: int) -> np.ndarray:
        """Samples `begin` to `end` of histories, which are all that long, (entries, end - begin).

        Only the parts that hold them are read.

        Raises:
            StoreError: a part is missing or is not as it was stored.
        """
        found = np.empty((len(entries), end - begin))
        if begin >= end:
            return found
        for width in {entry.width for entry in entries}:
            these = [k for k, entry in enumerate(entries) if entry.width == width]
            for place in range(begin // width, (end - 1) // width + 1):
                low, high = max(begin, place * width), min(end, (place + 1) * width)
                for part in range(0, len(these), AT_ONCE):
                    some = these[part : part + AT_ONCE]
                    rows = self._parts([entries[k] for k in some], place)
                    found[some, low - begin : high - begin] = rows[
                        :, low - place * width : high - place * width
                    ]
        return found

    def history(self, entry: Entry) -> History:
        """One history, whole."""
        return History(self.times(entry.axis), self.values([entry], 0, entry.samples)[0])

    def wrong(self) -> list[str]:
        """What SQLite finds wrong, and histories that are not as they were stored; empty when all is well."""
        with explained(self.path):
            found = [text for (text,) in self._db.execute("PRAGMA integrity_check") if text != "ok"]
        sound: dict[int, str] = {}
        for entry in self.entries():
            try:
                if entry.axis not in sound:
                    sound[entry.axis] = ""
                    self.times(entry.axis)
                self.values([entry], 0, entry.samples)
            except StoreError as exc:
                found.append(str(exc))
        return found

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        try:
            with transaction(self._db):
                yield
        except BaseException:
            self._axes.clear()  # some may have been new
            raise

    def _forget(self, key: str) -> None:
        """Remove the histories of a run."""
        for (id_,) in self._db.execute("SELECT id FROM history WHERE key = ?", [key]).fetchall():
            self._db.execute(
                "DELETE FROM part WHERE id BETWEEN ? AND ?", [id_ << PLACES, (id_ + 1 << PLACES) - 1]
            )
            self._db.execute("DELETE FROM history WHERE id = ?", [id_])

    def _axis(self, times: np.ndarray) -> tuple[bytes, int]:
        """Digest and number of a row of times, which is stored when it is new."""
        digest = _digest(times)
        if digest not in self._axes:
            if len(self._axes) >= KNOWN:
                self._axes.clear()
            content = packed(times, chunk=len(times))[0] if len(times) else b""
            ends = [float(times[0]), float(times[-1])] if len(times) else [None, None]
            self._db.execute(
                "INSERT OR IGNORE INTO axis (digest, samples, first, last, content) VALUES (?, ?, ?, ?, ?)",
                [digest, len(times), *ends, content],
            )
            query = "SELECT id FROM axis WHERE digest = ?"
            (self._axes[digest],) = self._db.execute(query, [digest]).fetchone()
        return digest, self._axes[digest]

    def _write_one(self, key: str, name: str, axis: int, unit: str, parts: Sequence[bytes]) -> None:
        number = self._db.execute(
            "INSERT INTO history (key, name, axis, unit) VALUES (?, ?, ?, ?)", [key, name, axis, unit]
        ).lastrowid
        assert number is not None
        self._db.executemany(
            "INSERT INTO part (id, content) VALUES (?, ?)",
            [((number << PLACES) + k, part) for k, part in enumerate(parts)],
        )

    def _parts(self, entries: Sequence[Entry], place: int) -> np.ndarray:
        """The samples in one part of each history, (entries, width)."""
        numbers = [(entry.id << PLACES) + place for entry in entries]
        marks = ", ".join("?" * len(numbers))
        with explained(self.path):
            rows = dict(self._db.execute(f"SELECT id, content FROM part WHERE id IN ({marks})", numbers))
        for entry, number in zip(entries, numbers, strict=True):
            if number not in rows:
                raise self._damaged(f"part {place} of {entry.name!r} of run {entry.key} is missing")
        where = f"part {place} of {entries[0].name!r} of run {entries[0].key}"
        where += f" or of the next {len(entries) - 1} runs" if len(entries) > 1 else ""
        seals = [entry.seal + place for entry in entries]
        return self._unpacked([rows[number] for number in numbers], entries[0].width, seals, where)

    def _unpacked(self, parts: list[bytes], width: int, seals: list[int], where: str) -> np.ndarray:
        try:
            return unpacked(parts, width, seals=seals)
        except ValueError as exc:
            raise self._damaged(f"{where}: {exc}") from None

    def _damaged(self, what: str) -> StoreError:
        return StoreError(
            f"{self.path} is damaged: {what}. Responses keep their values; `holdfast run --run-again` makes "
            "those runs anew that another reading of this history needs"
        )


def _check_version(path: Path, version: int) -> None:
    if version > VERSION:
        raise StoreError(
            f"{path} has schema {version}, this holdfast knows up to {VERSION}; update holdfast to read it"
        )


def _digest(times: np.ndarray) -> bytes:
    return blake2b(np.ascontiguousarray(times, dtype="<f8").tobytes(), digest_size=16).digest()


def _seal(key: str, name: str, digest: bytes) -> int:
    """Four bytes of the name of a history and of its axis."""
    return zlib.crc32(digest, zlib.crc32(f"{key} {name}".encode()))
