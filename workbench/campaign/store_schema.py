"""The tables of `runs.sqlite` and how an older database is brought up to them.

A change of the tables raises VERSION, adds the statements that lead there to MIGRATIONS, and leaves the
database of the version before as a fixture of the tests.
"""

import json
import sqlite3
from collections.abc import Callable, Mapping
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.campaign.integrity.checksums import CHECKED, CHECKSUMS
from workbench.errors import StoreError
from workbench.models.stored.evaluation import FAILED, UNFINISHED

__all__ = ["MIGRATIONS", "SCHEMA", "STATUSES", "VERSION", "kept_name", "migrate", "run_key"]

VERSION = 5

STATUSES = (*UNFINISHED, "ok", *FAILED, "skipped")

ATTEMPT = """
CREATE TABLE attempt (                     -- answers that did not become the answer of their run
  id       INTEGER PRIMARY KEY,
  key      TEXT NOT NULL,                  -- of the run
  attempt  INTEGER NOT NULL,
  status   TEXT NOT NULL,
  reason   TEXT NOT NULL,                  -- retried (the run was tried again) or late (it had its answer)
  outputs  TEXT,
  error    TEXT,
  log      TEXT,
  finished REAL NOT NULL,                  -- seconds since 1970
  wall     REAL,
  cpu      REAL,
  host     TEXT
);
CREATE INDEX attempt_key ON attempt (key);
"""

GRADIENT = """
CREATE TABLE gradient (                    -- of runs whose model gives derivatives
  key      TEXT PRIMARY KEY,               -- of the run
  slopes   TEXT NOT NULL                   -- JSON, response -> parameter -> derivative, in their units
);
"""

# a run is a simulation and a reading of it, by a model in some state
READING = """
CREATE TABLE reading (                     -- ways in which responses were read from what runs left
  id         INTEGER PRIMARY KEY,
  definition TEXT NOT NULL UNIQUE          -- JSON, response -> how it is read and reduced
);
CREATE TABLE model_state (                 -- states of the model; rows are added, never changed
  id       INTEGER PRIMARY KEY,
  digest   TEXT NOT NULL,                  -- of what decides results
  same_as  TEXT,                           -- digest of the state that a person vouched for it to equal
  content  TEXT NOT NULL,                  -- JSON, what the state consists of
  seen     REAL NOT NULL                   -- first time, seconds since 1970
);
ALTER TABLE evaluation ADD COLUMN reading INTEGER;
ALTER TABLE evaluation ADD COLUMN state INTEGER;
ALTER TABLE evaluation ADD COLUMN kept TEXT;
ALTER TABLE evaluation ADD COLUMN former TEXT;
"""

# a run may take the coordinator with it; a bit may turn over on the disk
STARTS_AND_CHECKSUMS = f"""
ALTER TABLE evaluation ADD COLUMN unanswered INTEGER NOT NULL DEFAULT 0;
{CHECKSUMS}"""

SCHEMA = f"""
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE evaluation (
  id       INTEGER PRIMARY KEY,            -- in the order in which runs were asked for
  key      TEXT NOT NULL UNIQUE,           -- blake2b of model, version and inputs
  status   TEXT NOT NULL CHECK (status IN ({", ".join(repr(s) for s in STATUSES)})),
  attempt  INTEGER NOT NULL DEFAULT 0,     -- how often it was begun
  batch    TEXT NOT NULL,                  -- design, worst_case, told, table, ...
  model    TEXT NOT NULL,                  -- identity of the model, JSON
  version  TEXT NOT NULL,                  -- version of the model
  inputs   TEXT NOT NULL,                  -- JSON, parameter -> value, full precision
  outputs  TEXT,                           -- JSON, response -> value, only when ok
  error    TEXT,                           -- class and text of the failure
  log      TEXT,                           -- tail of what the run printed, only after a failure
  created  REAL NOT NULL,                  -- seconds since 1970
  started  REAL,
  finished REAL,
  wall     REAL,                           -- s
  cpu      REAL,                           -- s
  host     TEXT,
  seed     INTEGER,                        -- of the study
  owner    TEXT                            -- who is at it: host, boot, process, its start; NULL otherwise
);
CREATE INDEX evaluation_status ON evaluation (status);
{ATTEMPT}{GRADIENT}{READING}{STARTS_AND_CHECKSUMS}"""

# version -> statements that lead from it to the next
MIGRATIONS = {1: ATTEMPT, 2: GRADIENT, 3: READING, 4: STARTS_AND_CHECKSUMS}


def run_key(model: str, version: str, inputs: Mapping[str, Any], *, repeat: int = 0) -> str:
    """The name of a run: a digest of model identity, version and inputs (in any order), and of a further run
    with the same inputs of its number `repeat`.

    >>> run_key("m", "1", {"a": 1.0, "b": 2.0}) == run_key("m", "1", {"b": 2.0, "a": 1.0})
    True
    """
    parts = [model, version, dict(sorted(inputs.items())), *([repeat] if repeat else [])]
    text = json.dumps(parts, separators=(",", ":"), allow_nan=False)
    return blake2b(text.encode(), digest_size=16).hexdigest()


def kept_name(name: str, how: Mapping[str, Any]) -> str:
    """Under which a response is kept that is none any more: what was read in two ways has two names."""
    return f"{name} {json.dumps(how, sort_keys=True)}" if how else name


def _part_readings(db: sqlite3.Connection) -> None:
    """Take the reading of responses out of the names of runs: what one simulation gave is one row.

    Of rows that differed in their reading alone, the last with a value stays and keeps what was read in the
    others, which become attempts. A row remembers its former key, under which its files stand.
    """
    columns = "id, key, status, model, version, inputs, outputs"
    best: dict[str, tuple[tuple[bool, int], str, int]] = {}
    kept: dict[str, dict[str, float]] = {}
    rows = db.execute(f"SELECT {columns} FROM evaluation").fetchall()
    for id_, key, status, model, version, inputs, outputs in rows:
        try:
            whole = json.loads(model)
        except ValueError:
            continue  # not of a study
        if not isinstance(whole, dict):
            continue
        how = whole.pop("responses", {})
        for response, variable in (whole.pop("outputs", {}) if whole.get("kind") == "fmu" else {}).items():
            how[response] = {**how.get(response, {}), "variable": variable}
        if status == "ok":
            read = {name: how.get(name, {}) for name in json.loads(outputs)}
            db.execute("UPDATE evaluation SET reading = ? WHERE id = ?", (_reading_id(db, read), id_))
        if not how:
            continue
        name = json.dumps(whole, sort_keys=True)
        new = run_key(name, version, json.loads(inputs))
        rank = (status == "ok", id_)
        if outputs:
            values = json.loads(outputs).items()
            kept.setdefault(new, {}).update({kept_name(n, how.get(n, {})): value for n, value in values})
        if new in best:
            loser = min((rank, key, id_), best[new])
            db.execute(
                "INSERT INTO attempt "
                "(key, attempt, status, reason, outputs, error, log, finished, wall, cpu, host) "
                "SELECT ?, attempt, status, 'other reading', outputs, error, log, "
                "COALESCE(finished, created), wall, cpu, host FROM evaluation WHERE id = ?",
                (new, loser[2]),
            )
            db.execute("DELETE FROM evaluation WHERE id = ?", (loser[2],))
        best[new] = max((rank, key, id_), best.get(new, (rank, key, id_)))
        db.execute("UPDATE evaluation SET former = key, model = ? WHERE id = ?", (name, id_))
    for new, (_, old, id_) in best.items():
        numbers = json.dumps(kept[new]) if new in kept else None
        db.execute("UPDATE evaluation SET key = ?, kept = ? WHERE id = ?", (new, numbers, id_))
        for table in ("gradient", "attempt"):
            db.execute(f"UPDATE {table} SET key = ? WHERE key = ?", (new, old))


def _reading_id(db: sqlite3.Connection, definition: Mapping[str, Any]) -> int:
    text = json.dumps(definition, sort_keys=True)
    db.execute("INSERT OR IGNORE INTO reading (definition) VALUES (?)", (text,))
    (found,) = db.execute("SELECT id FROM reading WHERE definition = ?", (text,)).fetchone()
    return int(found)


def _seal(db: sqlite3.Connection) -> None:
    """Give every row its checksum."""
    for table, columns in CHECKED.items():
        db.execute(f"UPDATE {table} SET checksum = row_checksum('{table}', {', '.join(columns)})")


# version -> what brings its rows into the new tables
ROWS: dict[int, Callable[[sqlite3.Connection], None]] = {3: _part_readings, 4: _seal}


def migrate(db: sqlite3.Connection, path: Path, version: int) -> None:
    """Bring the database at `path` from `version` to VERSION, in one transaction; a copy stays beside it.

    Raises:
        StoreError: the copy cannot be made; the database is untouched then.
    """
    backup = path.with_name(f"{path.name}.v{version}.backup")
    new = backup.with_name(f".{backup.name}.new")
    try:
        new.unlink(missing_ok=True)
        copy = sqlite3.connect(new)
        try:
            db.backup(copy)
        finally:
            copy.close()
        new.replace(backup)
    except (OSError, sqlite3.Error) as exc:
        raise StoreError(
            f"cannot keep a copy of {path} before bringing it to schema {VERSION}: {exc}"
        ) from exc
    try:
        db.execute("BEGIN IMMEDIATE")
        for v in range(version, VERSION):
            for statement in MIGRATIONS[v].split(";\n"):
                db.execute(statement)
            if v in ROWS:
                ROWS[v](db)
        db.execute(f"PRAGMA user_version = {VERSION}")
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise
