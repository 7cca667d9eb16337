PRAGMA foreign_keys=OFF;
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
INSERT INTO "attempt" VALUES(1,'1584d46a7ba645ea08db0ef17b1934b5',2,'ok','late','{"y": 9.0}',NULL,NULL,1795236392.0,0.1,0.1,'host');
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
INSERT INTO "evaluation" VALUES(1,'1584d46a7ba645ea08db0ef17b1934b5','ok',1,'design','{"function": "m.py:f", "kind": "python"}','1','{"a": 0.25803106650710106, "b": 0.8152247266843915}','{"y": 0.2103533056693335}',NULL,NULL,1.79523639163178133962e+09,1.79523639183520293234e+09,1.79523639187067389488e+09,1.25437999940913869068e-04,1.23583999999996030361e-04,'host',1,NULL);
INSERT INTO "evaluation" VALUES(2,'e8387284ad079cf071f86a24f10e6160','nonfinite',1,'design','{"function": "m.py:f", "kind": "python"}','1','{"a": 0.7850141962990165, "b": 0.2050249706953764}',NULL,'not a finite number: y = nan','hello 0.7850141962990165',1.79523639163178133962e+09,1.79523639183520293234e+09,1.7952363918708996773e+09,1.37459000143280718475e-04,1.36325999999992175659e-04,'host',1,NULL);
INSERT INTO "evaluation" VALUES(4,'26261db861d6af086d5735e109aeda5c','ok',1,'design','{"function": "m.py:f", "kind": "python"}','1','{"a": 0.24097838904708624, "b": 0.35004398599267006}','{"y": 0.08435303584013445}',NULL,NULL,1.79523639163178133962e+09,1.7952363918708791733e+09,1.79523639187097620957e+09,9.70249998317740391939e-05,5.97620000000048667843e-05,'host',1,NULL);
INSERT INTO "evaluation" VALUES(5,'a27d7309b4f42230575f595c55e44833','running',1,'design','{"function": "m.py:f", "kind": "python"}','1','{"a": 0.10993484687060118, "b": 0.5280148293823004}',NULL,NULL,NULL,1.79523639163178133962e+09,1.79523639187095975875e+09,1.79523639187102866179e+09,6.88110003466135822236e-05,6.81290000000001e-05,'host',1,'vm|boot|1|1');
INSERT INTO "evaluation" VALUES(14,'96b5cd14cbc11001c1b57349957f4843','killed',2,'design','{"function": "m.py:f", "kind": "python"}','1','{"a": 0.6281526386737823, "b": 0.09249935112893581}',NULL,'the worker process was ended by signal 11 (SIGSEGV)','hello 0.6281526386737823',1.79523639163178133962e+09,1.79523639279260540007e+09,1.79523639286925625804e+09,0.0,0.0,'host',1,NULL);
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
INSERT INTO "meta" VALUES('created_with','0.1.0');
CREATE INDEX evaluation_status ON evaluation (status);
CREATE INDEX attempt_key ON attempt (key);
PRAGMA user_version = 2;
COMMIT;
