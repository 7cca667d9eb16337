"""The tables of `runs.sqlite`. A change of the schema raises VERSION and adds a migration."""

__all__ = ["SCHEMA", "STATUSES", "VERSION"]

VERSION = 1

STATUSES = ("queued", "running", "ok", "failed", "timeout", "killed", "nonfinite", "skipped")

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
"""
