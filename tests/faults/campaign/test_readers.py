"""Looks at a campaign: beside a coordinator, as another user, on a read-only disk, from a dead one's log."""

import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from workbench.campaign.store import Store, run_key
from workbench.models.protocol import Answer
from workbench.study.loading import load_study
from workbench.system import database

ROOT = Path(__file__).parents[3]
STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 1
[[parameter]]
name = "b"
lower = 0
upper = 1
[[response]]
name = "y"
[design]
kind = "sobol"
runs = {runs}
[screen]
response = "y"
"""
CODE = """
import time
made = []
def f(a, b):
    made.append(a)
    if len(made) > {quick}:
        time.sleep(600)
    return a + b * b
"""

# many commands in one interpreter: a start costs a second each
VERBS = """
import contextlib, io, json, os, sys
from workbench.terminal.cli import main
study, out, warm, user, *verbs = sys.argv[1:]

def tried(verb, study, out):
    options = {"report": ["--output", out], "export": ["--output", out], "watch": ["--once"]}.get(verb, [])
    options = ["1"] if verb == "show" else options
    sys.argv = ["holdfast", verb, study, *options, "--json"]
    text, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.redirect_stderr(err):
        try:
            main()
            code = 0
        except SystemExit as exc:
            code = exc.code
    return [code, text.getvalue(), err.getvalue()]

if user:  # who cannot read the interpreter's files: everything is loaded before
    for verb in verbs:
        tried(verb, warm, os.path.join(os.path.dirname(warm), "out"))
    os.setegid(int(user))
    os.seteuid(int(user))
print(json.dumps({verb: tried(verb, study, out) for verb in verbs}))
"""
QUICK = ("failures", "export", "plan", "watch", "show")
ALL = ("failures", "export", "report", "screen", "plan", "watch", "show")
NOBODY = 65534


def looked(study, out, *, verbs=ALL, user="", warm="", check=True):
    """Exit code, output and errors by verb."""
    out.mkdir(exist_ok=True)
    if user:
        os.chown(out, user, user)
    done = subprocess.run(
        [sys.executable, "-c", VERBS, str(study), str(out), str(warm), str(user), *verbs],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "MPLCONFIGDIR": str(out)},
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for verb, (code, text, err) in found.items():
        assert "Traceback" not in err
        if check:
            assert code in (0, 3), (verb, err)
            assert text
    return found


def made(folder, *, runs=16, quick=10**9):
    (folder / "m.py").write_text(CODE.format(quick=quick))
    (folder / "s.toml").write_text(STUDY.format(runs=runs))
    return folder / "s.toml"


def filled(study):
    """A campaign with its runs, made without a process of its own."""
    from workbench.stages.campaign import Campaign
    from workbench.stages.run_all import run_stage

    with Campaign.from_file(study) as campaign:
        for a, b in run_stage(campaign, "design")["physical"]:
            campaign.tell(None, a + b * b, parameters={"a": a, "b": b})
    return study.with_suffix(".holdfast")


@pytest.mark.slow
def test_every_verb_looks_at_a_running_campaign(tmp_path):
    study = made(tmp_path, runs=24, quick=12)
    run = subprocess.Popen(
        [sys.executable, "-m", "workbench", "run", str(study)],
        cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    database_ = study.with_suffix(".holdfast") / "runs.sqlite"
    try:
        until = time.monotonic() + 90
        while time.monotonic() < until and run.poll() is None:
            if database_.exists() and answered(database_) >= 12:
                break
            time.sleep(0.05)
        found = looked(study, tmp_path / "out")
        assert run.poll() is None, "it went on"
    finally:
        run.send_signal(signal.SIGTERM)
        run.wait(60)
    for verb in ("failures", "export", "report", "screen"):
        assert f"running: process {run.pid} on " in found[verb][2], verb
        assert found[verb][2].count(f"process {run.pid}") == 1, verb
        assert "as of 20" in found[verb][2]
    for verb in ("failures", "plan", "watch", "show", "report"):
        looks = json.loads(found[verb][1])["as_of"]
        assert looks["running"].startswith(f"process {run.pid} on "), verb
        assert looks["last_answer"].endswith(" UTC")
    page = (tmp_path / "out" / "report.html").read_text()
    assert "The campaign is running (process" in page
    assert "of 24 runs have their answer" in page
    assert "The campaign is running (process" in (tmp_path / "out" / "report.md").read_text()
    assert "screening.json is left as it is" in found["screen"][2]
    assert not (study.with_suffix(".holdfast") / "screening.json").exists()


def answered(path):
    db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    try:
        return db.execute("SELECT COUNT(*) FROM evaluation WHERE status = 'ok'").fetchone()[0]
    except sqlite3.Error:
        return 0  # the tables are being made
    finally:
        db.close()


@pytest.fixture
def open_place():
    """A folder that everybody may enter; those of pytest are their user's own."""
    with TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.mark.skipif(os.geteuid() != 0, reason="to be another user needs the rights of the super-user")
@pytest.mark.parametrize("verbs", [QUICK, pytest.param(ALL, marks=pytest.mark.slow)])
@pytest.mark.parametrize("log", ["closed", "with a log"])
def test_another_user_looks_without_the_right_to_write(open_place, log, verbs):
    tmp_path = open_place
    (tmp_path / "warm").mkdir()
    warm = made(tmp_path / "warm")
    filled(warm)
    study = made(tmp_path)
    folder = filled(study)
    if log != "closed":
        leave_a_log(folder / "runs.sqlite", {"a": 0.25, "b": 0.25})
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    found = looked(study, tmp_path / "out", verbs=verbs, user=NOBODY, warm=warm)
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    assert "as of 20" in found["failures"][2]
    assert "shown as stored: cannot write in" in found["failures"][2]
    runs = json.loads(found["watch"][1])["done"]
    assert runs == (16 if log == "closed" else 17), "answers in the log are seen"


def leave_a_log(path, row):
    """An answer that is still in the log when its coordinator dies."""
    place = path.with_name("live")
    place.mkdir()
    shutil.copy(path, place / "runs.sqlite")
    store = Store.opened(place / "runs.sqlite")
    (model,), *_ = store.select("SELECT DISTINCT model FROM evaluation")
    key = run_key(model, "1", row)
    store.enqueue([(key, row)], batch="told", model=model, version="1", seed=1)
    store.finish(key, Answer(status="ok", outputs={"y": 1.0}), attempt=1)
    for name in ("runs.sqlite", "runs.sqlite-wal"):
        shutil.copy(place / name, path.with_name(name))
    store.close()
    shutil.rmtree(place)
    assert path.with_name("runs.sqlite-wal").stat().st_size > 0


@pytest.fixture
def fixed_disk(tmp_path):
    """A folder, and a function that makes it a read-only mount."""
    place = tmp_path / "disk"
    place.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=20m", "tmpfs", str(place)], capture_output=True, check=False
    )
    if made.returncode != 0:
        pytest.skip("mounting a file system needs the rights of the super-user")
    yield place, lambda: subprocess.run(["mount", "-o", "remount,ro", str(place)], check=True)
    subprocess.run(["umount", "-l", str(place)], check=True)


@pytest.mark.parametrize("verbs", [QUICK, pytest.param(ALL, marks=pytest.mark.slow)])
def test_every_verb_looks_at_a_read_only_mount(tmp_path, fixed_disk, verbs):
    place, fix = fixed_disk
    study = made(place)
    leave_a_log(filled(study) / "runs.sqlite", {"a": 0.25, "b": 0.25})
    fix()
    found = looked(study, tmp_path / "out", verbs=verbs)
    assert json.loads(found["watch"][1])["done"] == 17
    assert (tmp_path / "out" / "report.html").exists() == ("report" in verbs)
    assert (tmp_path / "out" / "runs.csv").read_text().count("\n") == 18
    refused = subprocess.run(
        [sys.executable, "-m", "workbench", "report", str(study)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert refused.returncode == 5
    assert "cannot be written from here; say where to with --output FOLDER" in refused.stderr


def test_what_cannot_be_seen_is_said(tmp_path, monkeypatch):
    study = made(tmp_path)
    path = filled(study) / "runs.sqlite"
    leave_a_log(path, {"a": 0.25, "b": 0.25})
    plain = database._queried

    def only_as_it_stands(uri):
        if "mode=ro" in uri:
            raise sqlite3.OperationalError("unable to open database file")
        return plain(uri)

    monkeypatch.setattr(database, "_queried", only_as_it_stands)
    store = Store.reading(path)
    assert (store.unseen, store.counts()) == ("", {"ok": 17})
    store.close()
    monkeypatch.setattr(database, "_copied", lambda path, log: None)  # it changes all the time
    store = Store.reading(path)
    assert "answers that are still in runs.sqlite-wal" in store.unseen
    assert store.counts() == {"ok": 16}
    store.close()


def test_a_look_names_what_is_missing(tmp_path, capsys):
    from workbench.campaign.view import CampaignView
    from workbench.errors import StoreError, StudyError
    from workbench.terminal.showing import run_document, run_lines

    study = load_study(made(tmp_path))
    with pytest.raises(StoreError, match=r"no database .*runs.sqlite; `holdfast run` makes it"):
        CampaignView.opened(study)
    folder = filled(tmp_path / "s.toml")
    with CampaignView.opened(study) as view:
        with pytest.raises(StudyError, match=r"no run goes by '99' in s.holdfast"):
            run_document(view, "99")
        with pytest.raises(StudyError, match=r"several runs begin by '' in s.holdfast"):
            run_document(view, "")
        shown = run_lines(run_document(view, view.runs()[2].key[:12]))
    assert shown[0].startswith("run 3 (")
    assert any(line.startswith("  y = ") for line in shown)
    if os.geteuid() != 0:
        (folder / "runs.sqlite").chmod(0)
        with pytest.raises(StoreError, match="may not be read by you"):
            CampaignView.opened(study)


@pytest.mark.parametrize("log", ["closed", "with a log"])
def test_a_look_of_another_user_leaves_no_file_that_the_owner_could_not_write(tmp_path, monkeypatch, log):
    path = filled(made(tmp_path)) / "runs.sqlite"
    if log != "closed":
        leave_a_log(path, {"a": 0.25, "b": 0.25})
    before = sorted(path.parent.iterdir())
    monkeypatch.setattr(os, "geteuid", lambda: NOBODY)  # in a folder that both may write
    store = Store.reading(path)
    assert store.counts() == {"ok": 16 if log == "closed" else 17}
    store.close()
    assert sorted(path.parent.iterdir()) == before
