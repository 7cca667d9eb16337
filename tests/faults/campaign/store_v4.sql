BEGIN TRANSACTION;
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
INSERT INTO "attempt" VALUES(1,'86c5ab677d0f2d69275f914fd7c56db6',1,'failed','retried',NULL,'ValueError: no',NULL,1.79544394590140724181e+09,0.0,0.0,NULL);
CREATE TABLE evaluation (
  id       INTEGER PRIMARY KEY,            -- in the order in which runs were asked for
  key      TEXT NOT NULL UNIQUE,           -- blake2b of model, version and inputs
  status   TEXT NOT NULL CHECK (status IN ('queued', 'running', 'ok', 'failed', 'timeout', 'killed', 'nonfinite', 'skipped')),
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
, reading INTEGER, state INTEGER, kept TEXT, former TEXT);
INSERT INTO "evaluation" VALUES(1,'b764e8ea33a9a0656e37d3172bcf2c4b','ok',1,'design','{"kind": "python"}','1','{"a": 0.25, "b": 1.0}','{"y": 0.3333333333333333}',NULL,NULL,1.79544394589711046221e+09,1.79544394590034437179e+09,1.79544394590091323854e+09,2.0,1.0,'h',1,NULL,1,1,NULL,NULL);
INSERT INTO "evaluation" VALUES(2,'86c5ab677d0f2d69275f914fd7c56db6','queued',1,'design','{"kind": "python"}','1','{"a": 0.5, "b": 2.0}',NULL,'ValueError: no',NULL,1.79544394589711046221e+09,1.79544394590034437179e+09,1.79544394590140724181e+09,0.0,0.0,NULL,1,NULL,1,1,NULL,NULL);
INSERT INTO "evaluation" VALUES(3,'db1fa907f5d153c3751462c890f9c0be','nonfinite',1,'design','{"kind": "python"}','1','{"a": 0.75, "b": 3.0}',NULL,'y = nan',NULL,1.79544394589711046221e+09,1.79544394590034437179e+09,1.79544394590803599353e+09,0.0,0.0,NULL,1,NULL,1,1,NULL,NULL);
INSERT INTO "evaluation" VALUES(4,'d0869d57c6b4c46f46e7c71ec1240479','queued',0,'design','{"kind": "python"}','1','{"a": 0.95, "b": 4.0}',NULL,NULL,NULL,1.79544394589711046221e+09,NULL,NULL,NULL,NULL,NULL,1,NULL,NULL,NULL,NULL,NULL);
CREATE TABLE gradient (                    -- of runs whose model gives derivatives
  key      TEXT PRIMARY KEY,               -- of the run
  slopes   TEXT NOT NULL                   -- JSON, response -> parameter -> derivative, in their units
);
INSERT INTO "gradient" VALUES('b764e8ea33a9a0656e37d3172bcf2c4b','{"y": {"a": 1.0, "b": 0.5}}');
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
INSERT INTO "meta" VALUES('created_with','0.1.0');
INSERT INTO "meta" VALUES('version 1','1');
CREATE TABLE model_state (                 -- states of the model; rows are added, never changed
  id       INTEGER PRIMARY KEY,
  digest   TEXT NOT NULL,                  -- of what decides results
  same_as  TEXT,                           -- digest of the state that a person vouched for it to equal
  content  TEXT NOT NULL,                  -- JSON, what the state consists of
  seen     REAL NOT NULL                   -- first time, seconds since 1970
);
INSERT INTO "model_state" VALUES(1,'abc',NULL,'{}',1.0);
CREATE TABLE reading (                     -- ways in which responses were read from what runs left
  id         INTEGER PRIMARY KEY,
  definition TEXT NOT NULL UNIQUE          -- JSON, response -> how it is read and reduced
);
INSERT INTO "reading" VALUES(1,'{"y": {}}');
CREATE INDEX evaluation_status ON evaluation (status);
CREATE INDEX attempt_key ON attempt (key);
COMMIT;
PRAGMA user_version = 4;
