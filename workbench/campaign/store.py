"""`runs.sqlite`, the record of truth: one row per evaluation, written by one coordinator only.

On a local disk the journal is a write-ahead log, on a network file system it is truncated in place; either
way a commit is on the disk before it is acknowledged. The first error of the database ends all writing.
"""

import json
import sqlite3
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from sys import intern
from typing import Any, final

from workbench.campaign.integrity.checksums import check_file, check_store, is_sound
from workbench.campaign.integrity.stale import release_stale
from workbench.campaign.store_queries import StoreQueries
from workbench.campaign.store_schema import SCHEMA, VERSION, migrate, run_key
from workbench.errors import StoreError
from workbench.models.protocol import Answer
from workbench.models.stored.evaluation import COLUMNS, UNFINISHED, Evaluation, evaluation_of
from workbench.models.stored.run_chunks import RunChunk, run_chunks
from workbench.system.collecting import without_collecting
from workbench.system.database import (
    NETWORK,
    connected,
    explained,
    file_system,
    opened_for_reading,
    tables,
    transaction,
)
from workbench.system.lease import owner_of_this_process
from workbench.system.one_writer import WriterLock
from workbench.system.starts import Starts, unanswered_starts
from workbench.system.witness import Witness, witness_says

__all__ = ["Store", "run_key"]

SLOPES = "(SELECT slopes FROM gradient WHERE gradient.key = evaluation.key)"
CHUNK = 500  # keys per statement
ANSWER_TEXT = (  # as `json.dumps` writes it: outputs are stored in that form, keys and statuses have no signs
    f"CASE WHEN status NOT IN {UNFINISHED} "
    """THEN '["' || key || '", "' || status || '", ' || COALESCE(outputs, '{}') || ']' END"""
)
STRETCH = 5_000  # rows that are looked for side by side
MANY = 50_000  # keys that are looked up one by one


@final
class Store(StoreQueries):
    """The database of a campaign. Open it with `Store.opened`.

    reading_now, state_now: numbers of the way of reading and of the model's state that answers belong to
    which are stored from now on (tables `reading` and `model_state`); None where nobody said.
    unseen: in words what cannot be seen of a store that is open for reading; empty when all can.
    """

    reading_now: int | None = None
    state_now: int | None = None

    def __init__(
        self, path: Path, connection: sqlite3.Connection, lock: WriterLock | None, *, unseen: str = ""
    ) -> None:
        self.path = path
        self.unseen = unseen
        self._db = connection
        self._lock = lock
        self._depth = 0
        self._columns = ", ".join((*COLUMNS, SLOPES, is_sound("evaluation")))
        self._witness: Witness | None = None
        self._answered: tuple[str, float] | None = None
        self.starts: Starts | None = None

    @classmethod
    def opened(cls, path: Path) -> "Store":
        """Open for writing, create when new, and put rows back in the queue whose owner is gone.

        Raises:
            StoreError: it is no database, of a newer version, or another coordinator has it open.
        """
        lock = WriterLock.taken(path)
        with ExitStack() as undone:
            undone.callback(lock.close)
            said = witness_says(path)
            if path.exists() and path.stat().st_size:
                check_file(path, said)  # a connection that may write would throw a damaged log away
            new = not path.exists()
            db = connected(path)
            undone.callback(db.close)
            store = cls(path, db, lock)
            with explained(path):
                wal = file_system(path.parent) not in NETWORK
                db.execute(f"PRAGMA journal_mode = {'WAL' if wal else 'TRUNCATE'}")
                db.execute("PRAGMA synchronous = FULL")
                if new or not tables(db):
                    check_store(db, path, said, thoroughly=False)
                    made = f"INSERT INTO meta (key, value) VALUES ('created_with', '{_own_version()}');"
                    db.executescript(f"BEGIN; {SCHEMA} {made} PRAGMA user_version = {VERSION}; COMMIT;")
                store._check_version(migrating=True)
            store._witness = Witness(path, said.get("last"))
            undone.callback(store._witness.close)
            begun = unanswered_starts(path)
            with store.transaction():
                release_stale(db, begun)
            store.starts = Starts(path)
            undone.pop_all()
        return store

    @classmethod
    def reading(cls, path: Path) -> "Store":
        """Open an existing database for reading: also while a coordinator writes, without the right to write.

        Raises:
            StoreError: there is none, it may not be read, or it is no database of holdfast's.
        """
        db, unseen = opened_for_reading(path)
        store = cls(path, db, None, unseen=unseen)
        with ExitStack() as undone, explained(path):
            undone.callback(store.close)
            store._check_version()
            undone.pop_all()
        return store

    def close(self) -> None:
        """Close the database and let others have it."""
        self._db.close()
        if self.starts is not None:
            self.starts.close()
            self.starts = None
        if self._witness is not None:
            self._witness.close()
            self._witness = None
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """All writes inside are on the disk at the end, or none."""
        if self._depth:
            yield
            return
        if self._lock is not None:
            self._lock.check()
        with explained(self.path):
            try:
                with transaction(self._db):
                    self._depth += 1
                    try:
                        yield
                    finally:
                        self._depth -= 1
            finally:
                answered, self._answered = self._answered, None
        if answered is not None and self._witness is not None:
            self._witness.saw(*answered)

    def select(self, query: str, values: Sequence[Any] = ()) -> list[Any]:
        """Rows of a query, for the other tables of a campaign."""
        with explained(self.path):
            return self._db.execute(query, values).fetchall()

    def write(self, statement: str, values: Sequence[Any] = ()) -> None:
        """One statement that writes, for the other tables of a campaign."""
        with self.transaction():
            self._db.execute(statement, values)

    def enqueue(
        self,
        rows: Iterable[tuple[str, Mapping[str, Any]]],
        *,
        batch: str,
        model: str,
        version: str,
        seed: int,
    ) -> None:
        """Add rows (key, inputs) as queued; a key that is there already stays as it is."""
        now = time.time()
        with self.transaction():
            self._db.executemany(
                "INSERT OR IGNORE INTO evaluation "
                "(key, status, batch, model, version, inputs, created, seed) "
                "VALUES (?, 'queued', ?, ?, ?, ?, ?, ?)",
                [(key, batch, model, version, json.dumps(dict(inputs)), now, seed) for key, inputs in rows],
            )

    def start(self, begun: Iterable[tuple[str, int]]) -> None:
        """Mark rows (key, attempt) as running, owned by this process."""
        now, owner = time.time(), owner_of_this_process()
        with self.transaction():
            self._db.executemany(
                "UPDATE evaluation SET status = 'running', attempt = ?, started = ?, owner = ? WHERE key = ?",
                [(attempt, now, owner, key) for key, attempt in begun],
            )

    def finish(
        self, key: str, answer: Answer, *, attempt: int, again: bool = False, host: str | None = None
    ) -> None:
        """Store the end of a run; `again`: the row returns to the queue, what went wrong joins its attempts.

        A row that has its answer keeps it: what comes later is kept as an attempt.
        """
        now = time.time()
        outputs = json.dumps(dict(answer.outputs)) if answer.status == "ok" else None
        with self.transaction():
            changed = self._db.execute(
                "UPDATE evaluation SET status = ?, attempt = ?, outputs = ?, error = ?, log = ?, "
                "kept = ?, reading = ?, state = ?, unanswered = 0, "
                "started = COALESCE(started, ?), finished = ?, wall = ?, cpu = ?, host = ?, owner = NULL "
                "WHERE key = ? AND status IN ('queued', 'running')",
                (
                    "queued" if again else answer.status,
                    attempt,
                    outputs,
                    _clean(answer.error),
                    _clean(answer.log),
                    json.dumps(dict(answer.kept)) if answer.kept else None,
                    self.reading_now,
                    self.state_now,
                    now - answer.wall,
                    now,
                    answer.wall,
                    answer.cpu,
                    host,
                    key,
                ),
            ).rowcount
            if changed and not again:
                self._answered = (key, now)
            if changed and answer.gradients and answer.status == "ok":
                slopes = json.dumps({name: dict(by) for name, by in answer.gradients.items()})
                self._db.execute("INSERT OR REPLACE INTO gradient (key, slopes) VALUES (?, ?)", (key, slopes))
            if again or not changed:
                reason = "retried" if changed else "late"
                text = (_clean(answer.error), _clean(answer.log))
                self._db.execute(
                    "INSERT INTO attempt "
                    "(key, attempt, status, reason, outputs, error, log, finished, wall, cpu, host) "
                    "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                    (key, attempt, answer.status, reason, outputs, *text, now, answer.wall, answer.cpu, host),
                )

    def release(self, keys: Sequence[str]) -> None:
        """Put running rows back in the queue."""
        with self.transaction():
            self._db.executemany(
                "UPDATE evaluation SET status = 'queued', owner = NULL WHERE key = ? AND status = 'running'",
                [(key,) for key in keys],
            )

    def retry(self, keys: Sequence[str]) -> None:
        """Put failed rows back in the queue with their attempts counted anew."""
        with self.transaction():
            self._db.executemany(
                "UPDATE evaluation SET status = 'queued', attempt = 0, unanswered = 0, error = NULL, "
                "log = NULL WHERE key = ? AND status IN ('failed', 'timeout', 'killed', 'nonfinite')",
                [(key,) for key in keys],
            )

    def rows(
        self,
        *,
        keys: Sequence[str] | None = None,
        batch: str | None = None,
        model: str | None = None,
        version: str | None = None,
    ) -> list[Evaluation]:
        """Rows in the order of `keys`, or all (of a batch, model or version) in the order asked for."""
        with explained(self.path):
            if keys is not None:
                found: dict[str, Evaluation] = {}
                for k in range(0, len(keys), CHUNK):
                    part = list(keys[k : k + CHUNK])
                    marks = ", ".join("?" * len(part))
                    cursor = self._db.execute(
                        f"SELECT {self._columns} FROM evaluation WHERE key IN ({marks})", part
                    )
                    found.update((row.key, row) for row in map(self._sound, cursor))
                return [found[key] for key in keys if key in found]
            where, values = [], []
            for column, value in (("batch", batch), ("model", model), ("version", version)):
                if value is not None:
                    where.append(f"{column} = ?")
                    values.append(value)
            clause = f"WHERE {' AND '.join(where)}" if where else ""
            query = f"SELECT {self._columns} FROM evaluation {clause} ORDER BY id"
            with without_collecting():
                return [self._sound(row) for row in self._db.execute(query, values)]

    def answers_as_text(self, keys: Sequence[str]) -> str:
        """`["key", "status", {outputs}], ...` of the finished rows as they stand in the file, in the order of
        `keys`; nothing is parsed or held against its checksum."""
        text = self._of_neighbours(keys, ANSWER_TEXT, ", ")
        if text is not None:
            return text
        found = self._looked_up(keys, ANSWER_TEXT)
        return ", ".join(text for text in map(found.get, keys) if text is not None)

    def chunks(self, *, model: str, version: str, names: Collection[str]) -> Iterator[RunChunk]:
        """Runs of a model and version with these parameters, some thousand at a time."""
        with explained(self.path):
            yield from run_chunks(self._db, self.path, model=model, version=version, names=names)

    def statuses(self, keys: Sequence[str]) -> dict[str, str]:
        """The status of every known key, in the order of `keys`."""
        found: dict[str, str] = {}
        others: list[str] = []
        for k in range(0, len(keys), STRETCH):
            part = keys[k : k + STRETCH]
            text = self._of_neighbours(part, "status", " ")
            if text is not None and text == " ".join([first := intern(text.partition(" ")[0])] * len(part)):
                found.update(dict.fromkeys(part, first))  # all the same: nothing to take apart
                continue
            words = [] if text is None else text.split(" ")
            if len(words) == len(part):  # a damaged one may have a blank
                found.update(zip(part, map(intern, words), strict=True))
            else:
                others += part
        if not others:
            return found
        if len(others) > MANY:  # reading all is quicker than looking up so many
            with explained(self.path), without_collecting():
                rows = self._db.execute("SELECT key, status FROM evaluation")
                found = {key: intern(status) for key, status in rows}
        else:
            found.update(self._looked_up(others, "status"))
        return {key: found[key] for key in dict.fromkeys(keys) if key in found}

    def _of_neighbours(self, keys: Sequence[str], what: str, between: str) -> str | None:
        """An SQL expression of the rows `keys` as one text, without those where it is NULL; None where the
        rows do not lie in the file in this order.

        Those of a design do: SQLite puts the text of a stretch of them together, a third of the work of
        fetching row after row. That it is these rows, in this order, is seen at their keys.
        """
        query = (
            f"SELECT group_concat(key, ' '), COALESCE(group_concat(what, '{between}'), '') FROM "
            f"(SELECT key, {what} AS what FROM evaluation "
            "WHERE id >= (SELECT id FROM evaluation WHERE key = ?) ORDER BY id LIMIT ?)"
        )
        if not keys:
            return ""
        ((there, text),) = self.select(query, [keys[0], len(keys)])
        return text if there == " ".join(keys) else None

    def _looked_up(self, keys: Sequence[str], what: str) -> dict[str, Any]:
        """An SQL expression of rows by their keys."""
        found: dict[str, Any] = {}
        for k in range(0, len(keys), CHUNK):
            part = list(keys[k : k + CHUNK])
            marks = ", ".join("?" * len(part))
            found.update(self.select(f"SELECT key, {what} FROM evaluation WHERE key IN ({marks})", part))
        return found

    def _check_version(self, *, migrating: bool = False) -> None:
        (version,) = self._db.execute("PRAGMA user_version").fetchone()
        if version > VERSION:
            known = f"this holdfast knows up to {VERSION}; update holdfast, or see `holdfast doctor --store`"
            raise StoreError(f"{self.path} has schema {version}, {known}")
        if version < 1 or "evaluation" not in tables(self._db):
            raise StoreError(f"{self.path} is a database, but not one of holdfast's; choose another --folder")
        if version < VERSION and migrating:
            migrate(self._db, self.path, version)
        if "gradient" not in tables(self._db):
            self._columns = ", ".join((*COLUMNS, "NULL", "1"))  # an older version, opened for reading
        elif version < VERSION:
            self._columns = ", ".join((*COLUMNS, SLOPES, "1"))

    def _sound(self, row: Sequence[Any]) -> Evaluation:
        """The record of a row that is as it was stored."""
        *cells, sound = row
        if not sound:
            raise StoreError(
                f"{self.path} is damaged: run {cells[0]} ({cells[1]}) is not as it was stored. `holdfast "
                "doctor --store` says what else is wrong, `holdfast recover` saves what can be read"
            )
        return evaluation_of(cells)


def _clean(text: str) -> str | None:
    """Text that SQLite can hold."""
    return text.encode("utf-8", errors="backslashreplace").decode().replace("\0", "\\0") or None


def _own_version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("holdfast")
    except PackageNotFoundError:
        return "unknown"
