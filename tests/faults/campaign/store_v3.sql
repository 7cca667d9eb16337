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
);
INSERT INTO "evaluation" VALUES(1,'2fd46cd2cc18eb18d37158fa470c66f8','ok',1,'design','{"command": ["{python}", "{study}/sol.py", "{a}", "{b}"], "environment": {}, "files": [], "kind": "command", "responses": {"end": {"read": {"file": "log.txt", "kind": "regex", "pattern": "end = (\\S+)"}}, "force": {"at": null, "p": 2.0, "read": {"column": "f", "file": "out.csv", "kind": "csv"}, "reduce": "max"}}, "templates": []}','1','{"a": 0.25, "b": 0.5}','{"force": 0.0, "end": 0.75}',NULL,NULL,1.79539365156104421608e+09,1.79539365178756809239e+09,1.79539365212084698676e+09,2.79191270001319935545e-02,1.46119599999999794093e-03,'host',1,NULL);
INSERT INTO "evaluation" VALUES(2,'143cef1e787f428b426f5548d4752f54','ok',1,'design','{"command": ["{python}", "{study}/sol.py", "{a}", "{b}"], "environment": {}, "files": [], "kind": "command", "responses": {"end": {"read": {"file": "log.txt", "kind": "regex", "pattern": "end = (\\S+)"}}, "force": {"at": null, "p": 2.0, "read": {"column": "f", "file": "out.csv", "kind": "csv"}, "reduce": "max"}}, "templates": []}','1','{"a": 0.75, "b": 0.125}','{"force": 1.125, "end": 0.875}',NULL,NULL,1.79539365156104421608e+09,1.79539365212056636813e+09,1.79539365217285561563e+09,3.11527579997346037998e-02,1.19993199999999383686e-03,'host',1,NULL);
INSERT INTO "evaluation" VALUES(3,'68d0763dec0e2e1b3697598a9fda8b12','failed',1,'design','{"command": ["{python}", "{study}/sol.py", "{a}", "{b}"], "environment": {}, "files": [], "kind": "command", "responses": {"end": {"read": {"file": "log.txt", "kind": "regex", "pattern": "end = (\\S+)"}}, "force": {"at": null, "p": 2.0, "read": {"column": "f", "file": "out.csv", "kind": "csv"}, "reduce": "max"}}, "templates": []}','1','{"a": 0.95, "b": 0.5}',NULL,'python ended with exit code 4 (kept in work/68d0763dec0e2e1b3697598a9fda8b12)',NULL,1.79539365156104421608e+09,1.79539365217260313027e+09,1.79539365217693972585e+09,2.82042280005043721757e-02,7.94638000000000288558e-04,'host',1,NULL);
INSERT INTO "evaluation" VALUES(4,'e189e9becb5adb9a94b5b4dc4909e526','ok',1,'design','{"command": ["{python}", "{study}/sol.py", "{a}", "{b}"], "environment": {}, "files": [], "kind": "command", "responses": {"end": {"read": {"file": "log.txt", "kind": "regex", "pattern": "end = (\\S+)"}}, "force": {"at": null, "p": 2.0, "read": {"column": "f", "file": "out.csv", "kind": "csv"}, "reduce": "min"}}, "templates": []}','1','{"a": 0.25, "b": 0.5}','{"force": -7.0, "end": 0.75}',NULL,NULL,1.79539365239682722086e+09,1795393652.59859,1.79539365264069437975e+09,3.18278369995823595672e-02,1.55029300000000119785e-03,'host',1,NULL);
INSERT INTO "evaluation" VALUES(5,'478de033dd7e79a9522be842ad3ed57c','queued',0,'design','{"command": ["{python}", "{study}/sol.py", "{a}", "{b}"], "environment": {}, "files": [], "kind": "command", "responses": {"end": {"read": {"file": "log.txt", "kind": "regex", "pattern": "end = (\\S+)"}}, "force": {"at": null, "p": 2.0, "read": {"column": "f", "file": "out.csv", "kind": "csv"}, "reduce": "min"}}, "templates": []}','1','{"a": 0.5, "b": 0.5}',NULL,NULL,NULL,1.79539365265290236468e+09,NULL,NULL,NULL,NULL,NULL,1,NULL);
CREATE TABLE gradient (                    -- of runs whose model gives derivatives
  key      TEXT PRIMARY KEY,               -- of the run
  slopes   TEXT NOT NULL                   -- JSON, response -> parameter -> derivative, in their units
);
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
INSERT INTO "meta" VALUES('created_with','0.1.0');
CREATE INDEX evaluation_status ON evaluation (status);
CREATE INDEX attempt_key ON attempt (key);
PRAGMA user_version = 3;
COMMIT;
