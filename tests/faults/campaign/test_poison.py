"""An input that takes the coordinator with it is set aside after two starts; scratch goes with its pool."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workbench.campaign.store import Store, run_key
from workbench.errors import StoreError
from workbench.models.protocol import Answer, ModelSpec
from workbench.stages.campaign import Campaign
from workbench.system.starts import Starts, unanswered_starts
from workbench.workers.apart import answered_apart
from workbench.workers.processes import ProcessPool

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
[[response]]
name = "y"
[evaluate]
engine = "{engine}"
workers = 2
{more}
"""
# the third input of ten takes the process with it that coordinates the runs
CODE = """
import os, signal
def f(a):
    if a == 0.3:
        os.kill({whom}, signal.SIGKILL)
    return 2 * a
"""
DRIVER = """
import sys
from workbench.stages.campaign import Campaign
with Campaign.from_file(sys.argv[1]) as campaign:
    campaign.evaluate([{"a": k / 10} for k in range(10)])
"""


def made(folder, *, engine, whom="os.getpid()", more="", code=CODE):
    (folder / "m.py").write_text(code.format(whom=whom))
    (folder / "s.toml").write_text(STUDY.format(engine=engine, more=more))
    return folder / "s.toml"


def driven(study):
    """The exit code of a coordinator of ten runs."""
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, str(study)], cwd=ROOT, capture_output=True, text=True, timeout=120,
        check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode


def stored(study):
    db = sqlite3.connect(study.with_suffix(".holdfast") / "runs.sqlite")
    found = db.execute("SELECT inputs, status, attempt, error FROM evaluation ORDER BY id").fetchall()
    db.close()
    return found


@pytest.mark.parametrize(
    ("engine", "whom", "deaths"), [("inline", "os.getpid()", 1), ("processes", "os.getppid()", 2)]
)
def test_poison_is_set_aside_and_all_others_run(tmp_path, engine, whom, deaths):
    study = made(tmp_path, engine=engine, whom=whom)
    codes = [driven(study) for _ in range(deaths + 1)]
    assert codes == [-signal.SIGKILL] * deaths + [0]
    rows = stored(study)
    assert [row[1] for row in rows] == ["ok"] * 3 + ["killed"] + ["ok"] * 6
    assert rows[3][2] == 2, "two starts"
    assert "ended its process twice" in rows[3][3] or "the coordinator ended 2 times" in rows[3][3]
    left = {path.name for path in study.with_suffix(".holdfast").iterdir()}
    assert not left & {"scratch", ".runs.sqlite.starts", ".runs.sqlite.lease"}
    with Campaign.from_file(study) as campaign:
        campaign.retry()
        assert campaign.store.suspects() == set(), "who asks for it again is believed"


def test_kills_from_outside_set_nothing_aside_that_has_not_run_alone(tmp_path):
    study = made(
        tmp_path, engine="processes", code="import time\ndef f(a):\n    time.sleep(0.3)\n    return a\n"
    )
    for _ in range(2):
        run = subprocess.Popen([sys.executable, "-c", DRIVER, str(study)], cwd=ROOT)
        scratch = study.with_suffix(".holdfast") / "scratch"
        until = time.monotonic() + 60
        while time.monotonic() < until and not list(scratch.glob("holdfast-*/worker-*.log")):
            time.sleep(0.01)
        run.kill()
        run.wait()
        until = time.monotonic() + 5
        while scratch.exists() and time.monotonic() < until:
            time.sleep(0.02)
        assert not scratch.exists(), "nothing is left behind after a kill"
    assert driven(study) == 0
    assert {row[1] for row in stored(study)} == {"ok"}


def queue(store, *rows):
    keys = [run_key("m", "1", row) for row in rows]
    store.enqueue(zip(keys, rows, strict=True), batch="design", model="m", version="1", seed=7)
    return keys


def test_starts_are_counted_before_the_run_begins(tmp_path):
    path = tmp_path / "runs.sqlite"
    store = Store.opened(path)
    first, second, third = queue(store, {"a": 1.0}, {"a": 2.0}, {"a": 3.0})
    store.starts.begin(first)
    store.starts.begin(second)
    store.starts.end(second)
    store.starts.begin(third, apart=True)
    assert unanswered_starts(path) == [first]
    beside = tmp_path / ".runs.sqlite.starts"
    text = beside.read_text()
    store.close()
    assert not beside.exists()
    assert unanswered_starts(path) == []
    for times in (1, 2):
        beside.write_text(f"{text}+{second[:7]}")  # the coordinator was gone, the last line half written
        store = Store.opened(path)
        assert store.suspects() == ({first} if times == 1 else set())
        row = store.rows(keys=[first])[0]
        assert (row.status, row.attempt) == ("queued" if times == 1 else "killed", times)
        store.close()
    store = Store.opened(path)
    assert "the coordinator ended 2 times while this run was under way" in store.rows(keys=[first])[0].error
    assert [row.status for row in store.rows()] == ["killed", "queued", "queued"]
    store.close()


def test_the_lines_of_answered_runs_are_dropped(tmp_path, monkeypatch):
    from workbench.system import starts

    monkeypatch.setattr(starts, "LONGEST", 200)
    found = Starts(tmp_path / "r")
    found.begin("long")
    for k in range(50):
        found.begin(f"key{k}")
        found.end(f"key{k}")
        found.end("unknown")
    assert (tmp_path / ".r.starts").stat().st_size < 300
    assert unanswered_starts(tmp_path / "r") == ["long"]
    found.close()


def test_a_run_apart_answers_or_is_killed(tmp_path):
    answer = Answer(status="ok", outputs={"y": 1 / 3})
    assert answered_apart(lambda: answer) == answer
    gone = answered_apart(lambda: os._exit(3))
    assert (gone.status, gone.error) == (
        "killed",
        "it ended its process twice, the second time with exit code 3",
    )
    gone = answered_apart(lambda: os.kill(os.getpid(), signal.SIGKILL))
    assert gone.error.endswith("with signal 9")


def spec_of(folder, code):
    (folder / "m.py").write_text(code)
    return ModelSpec(
        kind="python", options={"function": "m.py:f"}, folder=str(folder), names=("a",),
        responses={"y": None}, identity="m", version="1",
    )  # fmt: skip


def test_scratch_is_made_anew_when_it_is_swept_away(tmp_path):
    import shutil

    code = "import tempfile\ndef f(a):\n    with tempfile.TemporaryFile():\n        return a\n"
    pool = ProcessPool(spec_of(tmp_path, code), workers=1, scratch=tmp_path / "place")
    try:
        for k in range(3):
            pool.submit(k, {"a": 1.0})
            ((_, answer),) = pool.completed()
            assert answer.status == "ok", answer.error
            shutil.rmtree(tmp_path / "place")
    finally:
        pool.close()
    assert not (tmp_path / "place").exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(
        StoreError, match=r"cannot make the scratch folder .*file.* another in \[evaluate\] scratch"
    ):
        ProcessPool(spec_of(tmp_path, code), scratch=tmp_path / "file")


def test_scratch_stands_where_the_study_says(tmp_path):
    code = "import tempfile\nfrom pathlib import Path\ndef f(a):\n    p = tempfile.gettempdir()\n"
    code += "    Path(__file__).with_name('seen').write_text(p)\n    return a\n"
    study = made(tmp_path, engine="processes", more='scratch = "fast/disk"', code=code)
    old = tmp_path / "fast" / "disk"
    with Campaign.from_file(study) as campaign:
        campaign.evaluate([{"a": 0.5}])
        seen = Path((tmp_path / "seen").read_text())
        assert seen.is_relative_to(old)
        assert seen.parent.name.startswith("s.holdfast-")
        (seen.parent / "holdfast-older").mkdir()  # of a machine that lost its power
    assert not seen.exists()
    with Campaign.from_file(study):
        assert list(old.iterdir()) == []
