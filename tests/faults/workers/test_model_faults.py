"""A model that dies, hangs, eats memory, floods its output or leaves children: the campaign completes."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workbench.errors import StudyError
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study
from workbench.system.processes.process_tree import marked_processes
from workbench.workers.processes import ProcessPool

GONE_WITHIN = 5.0  # s: the promise for processes of a killed coordinator
SLOWNESS = 2.0  # s: a hang is over within its timeout and this

MODEL = """
import ctypes, os, signal, subprocess, sys, time

def detached():
    '''A grandchild in a session of its own, whose parent is gone.'''
    subprocess.Popen(
        [sys.executable, "-c", "import subprocess as s; s.Popen(['sleep', '600'], start_new_session=True)"],
        start_new_session=True,
    ).wait()

def f(a):
    n = round(a)
    print("run", n)
    if n % 10 != 7:
        return a / 3
    kind = n // 10
    if kind == 0: os.kill(os.getpid(), signal.SIGKILL)
    if kind == 1: os.kill(os.getpid(), signal.SIGSEGV)
    if kind == 2: os._exit(9)
    if kind == 3:
        detached()
        time.sleep(600)
    if kind == 4: bytearray(3_000_000_000)
    if kind == 5:
        detached()
        ctypes.string_at(0)
    if kind == 6: os.abort()
    if kind == 7:
        os.close(1); os.close(2)
        raise ValueError("without a log")
    if kind == 8:
        sys.stdout.buffer.write(bytes(range(256)) * 1000)
        raise ValueError(bytes(range(256)).decode("latin1"))
    if kind == 9: return [1.0] * 10**6
"""

STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 1000
[[response]]
name = "y"
[evaluate]
workers = 2
timeout = 1.0
memory = "1 GB"
"""


def open_study(folder, code, text=STUDY):
    (folder / "m.py").write_text(code)
    (folder / "s.toml").write_text(text)
    return Campaign.from_file(folder / "s.toml")


def sleepers(folder):
    """Processes `sleep 600` that a run of a study in `folder` has left behind."""
    found = []
    for pid in marked_processes(""):
        try:
            here = Path(f"/proc/{pid}/cwd").readlink() == folder
            if here and Path(f"/proc/{pid}/cmdline").read_bytes() == b"sleep\x00600\x00":
                found.append(pid)
        except OSError:
            pass
    return found


def test_a_run_that_raises_what_ctrl_c_raises_fails_and_does_not_end_its_process(tmp_path):
    with open_study(tmp_path, "def f(a):\n    if a > 1: raise KeyboardInterrupt\n    return a\n") as campaign:
        rows = campaign.evaluate([{"a": float(n)} for n in range(4)])
    assert [(row.status, row.attempt) for row in rows] == [("ok", 1), ("ok", 1), ("failed", 1), ("failed", 1)]
    assert rows[2].error == "KeyboardInterrupt"


def test_every_tenth_run_goes_wrong_in_another_way(tmp_path):
    with open_study(tmp_path, MODEL) as campaign:
        rows = campaign.evaluate([{"a": float(n)} for n in range(100)])
        assert sleepers(tmp_path) == []  # a run's grandchildren end with it
    status = {n: row.status for n, row in enumerate(rows) if n % 10 == 7}
    good = [(n, row) for n, row in enumerate(rows) if n % 10 != 7]
    assert [(n, row.status, row.error) for n, row in good if row.status != "ok"] == []
    assert all(row.outputs["y"] == n / 3 for n, row in good)
    assert status == {
        7: "killed", 17: "killed", 27: "killed", 37: "timeout", 47: "failed",
        57: "killed", 67: "killed", 77: "failed", 87: "failed", 97: "failed",
    }  # fmt: skip
    assert "signal 9 (SIGKILL)" in rows[7].error
    assert "signal 11 (SIGSEGV)" in rows[17].error
    assert "exit code 9" in rows[27].error
    assert rows[37].wall < 1.0 + SLOWNESS
    assert "MemoryError" in rows[47].error
    assert "signal 6 (SIGABRT)" in rows[67].error
    assert "without a log" in rows[77].error
    assert len(rows[87].log) < 20_000
    assert len(rows[97].error) < 1000
    assert [campaign_attempts for campaign_attempts in (rows[7].attempt, rows[37].attempt)] == [2, 1]


def test_what_is_poison_stops_after_two_deaths_and_is_on_record(tmp_path):
    with open_study(tmp_path, "import os\ndef f(a): os._exit(3)") as campaign:
        (row,) = campaign.evaluate([{"a": 1.0}])
        assert (row.status, row.attempt) == ("killed", 2)
        text = "the worker process ended by itself with exit code 3"
        assert campaign.store.attempts(row.key) == [(1, "killed", "retried", text)]


def test_retries_follow_the_study(tmp_path):
    code = (
        "import os\n"
        "def f(a):\n"
        "    n = len(os.listdir('tries'))\n"
        "    open(f'tries/{n}', 'w')\n"
        "    return a if n == 2 else 1 / 0\n"
    )
    (tmp_path / "tries").mkdir()
    with open_study(tmp_path, code, STUDY + "retries = 2\n") as campaign:
        (row,) = campaign.evaluate([{"a": 1.0}])
        assert (row.status, row.attempt, row.outputs) == ("ok", 3, {"y": 1.0})
        assert [a[1] for a in campaign.store.attempts(row.key)] == ["failed", "failed"]


def test_memory_that_grows_slowly_in_a_child_is_seen(tmp_path):
    code = (
        "import subprocess, sys\n"
        "GROW = 'import time\\nk = []\\nwhile True: k.append(bytes([1]) * 10**7); time.sleep(0.01)'\n"
        "def f(a): subprocess.run([sys.executable, '-c', GROW])\n"
    )
    text = STUDY.replace("1 GB", "150 MB").replace("timeout = 1.0", "timeout = 30.0")
    with open_study(tmp_path, code, text) as campaign:
        (row,) = campaign.evaluate([{"a": 1.0}])
    # whichever meets it first: the inherited limit on address space, or the watch on what it holds
    assert row.status in ("killed", "failed")
    assert row.wall < 20
    assert "150 MB" in row.error or "None" in row.error


def test_endless_output_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr("workbench.workers.processes.LONGEST_LOG", 1_000_000)
    code = "def f(a):\n    while True: print('x' * 10_000, flush=True)"
    with open_study(tmp_path, code, STUDY.replace("timeout = 1.0", "timeout = 30.0")) as campaign:
        (row,) = campaign.evaluate([{"a": 1.0}])
    assert (row.status, row.error) == ("killed", "wrote more than 1 MB of output")
    assert row.log.endswith("x")
    assert len(row.log) <= 4000


def test_a_model_that_hangs_while_it_is_opened(tmp_path, monkeypatch):
    monkeypatch.setattr("workbench.workers.processes.START_TIMEOUT", 0.5)
    with open_study(tmp_path, "import time\ntime.sleep(600)") as campaign:
        with pytest.raises(
            StudyError, match=r"the model was not ready after 0.5 s; does importing it start work"
        ):
            campaign.evaluate([{"a": 1.0}])
        assert campaign.store.counts() == {"queued": 1}


def test_workers_that_die_while_idle_are_replaced(tmp_path):
    with open_study(tmp_path, "def f(a): return a") as campaign:
        campaign.evaluate([{"a": 1.0}])
        for worker in campaign._engine._workers:
            worker.process.kill()
        rows = campaign.evaluate([{"a": 2.0}, {"a": 3.0}])
    assert [row.outputs["y"] for row in rows] == [2.0, 3.0]


def test_what_a_run_leaves_behind_ends_with_the_pool(tmp_path):
    code = MODEL + "\ndef g(a):\n    detached()\n    return a\n"
    with open_study(tmp_path, code, STUDY.replace("m.py:f", "m.py:g")) as campaign:
        assert campaign.evaluate([{"a": 1.0}])[0].status == "ok"
        assert len(sleepers(tmp_path)) == 1
    assert sleepers(tmp_path) == []


def test_no_orphan_outlives_a_killed_coordinator(tmp_path):
    code = MODEL + "\ndef g(a):\n    detached()\n    open('began', 'w')\n    time.sleep(600)\n"
    text = STUDY.replace("m.py:f", "m.py:g").replace("timeout = 1.0", "")
    open_study(tmp_path, code, text).close()
    driver = (
        "from workbench import Campaign\n"
        f"Campaign.from_file({str(tmp_path / 's.toml')!r}).evaluate([{{'a': 1.0}}, {{'a': 2.0}}])"
    )
    process = subprocess.Popen([sys.executable, "-c", driver], cwd=os.getcwd())
    try:
        until = time.monotonic() + 60
        while (busy := len(sleepers(tmp_path))) < 2 and time.monotonic() < until:
            time.sleep(0.02)
    finally:
        process.kill()
        process.wait()
    assert busy == 2
    until = time.monotonic() + GONE_WITHIN
    while (left := sleepers(tmp_path)) and time.monotonic() < until:
        time.sleep(0.02)
    for pid in left:
        os.kill(pid, 9)
    assert left == []


def test_the_probe_starts_all_workers(tmp_path):
    (tmp_path / "m.py").write_text("def f(a): return a")
    (tmp_path / "s.toml").write_text(STUDY)
    pool = ProcessPool(load_study(tmp_path / "s.toml").spec(version="1"), workers=2)
    try:
        assert pool.probe()["workers"] == 2
        assert len(pool._workers) == 2
    finally:
        pool.close()
