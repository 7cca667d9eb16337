"""The tables of `runs.sqlite` and how an older database is brought up to them.

A change of the tables raises VERSION, adds the statements that lead there to MIGRATIONS, and leaves the
database of the version before as a fixture of the tests.
"""

import sqlite3
from pathlib import Path

from workbench.errors import StoreError
from workbench.models.evaluation import FAILED, UNFINISHED

__all__ = ["MIGRATIONS", "SCHEMA", "STATUSES", "VERSION", "migrate"]

VERSION = 3

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
{ATTEMPT}{GRADIENT}"""

# version -> statements that lead from it to the next
MIGRATIONS = {1: ATTEMPT, 2: GRADIENT}


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
    steps = "".join(MIGRATIONS[v] for v in range(version, VERSION))
    db.executescript(f"BEGIN IMMEDIATE; {steps} PRAGMA user_version = {VERSION}; COMMIT;")
