"""A comparison of designs killed between its runs goes on to the document of an undisturbed one."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
MODEL = """
import time

def f(k, u):
    time.sleep(0.01)
    if u > 0.9:
        raise ValueError("no equilibrium")
    return u / k
"""
STUDY = """
constraint = ["k + u <= 2.86"]
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "k"
lower = 1
upper = 4
[[parameter]]
name = "u"
lower = 0
upper = 1
baseline = 0.5
[[response]]
name = "y"
[robust]
response = "y"
samples = 100
[[robust.design]]
name = "soft"
values = { k = 1.0 }
[[robust.design]]
name = "stiff"
values = { k = 1.9 }
"""


def started(folder):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "workbench", "robust", str(folder / "s.toml")]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
    )


def study_in(folder):
    folder.mkdir()
    (folder / "m.py").write_text(MODEL)
    (folder / "s.toml").write_text(STUDY)
    return folder


def ended(folder, status):
    """How many runs have this status; 0 before there is a store."""
    file = folder / "s.holdfast" / "runs.sqlite"
    if not file.exists():
        return 0
    store = sqlite3.connect(f"file:{file}?mode=ro", uri=True)
    try:
        (count,) = store.execute("select count(*) from evaluation where status = ?", (status,)).fetchone()
    except sqlite3.OperationalError:  # the tables are not there yet
        return 0
    finally:
        store.close()
    return int(count)


def finished(folder):
    process = started(folder)
    _, error = process.communicate(timeout=120)
    assert process.returncode == 3, error.decode()  # 3: finished, with failed runs
    return json.loads((folder / "s.holdfast" / "robust.json").read_text())


def killed_after(folder, runs):
    process = started(folder)
    end = time.monotonic() + 60
    while ended(folder, "ok") < runs:
        assert process.poll() is None, process.stderr.read().decode()
        assert time.monotonic() < end
        time.sleep(0.005)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


@pytest.mark.slow
def test_kills_in_either_design_change_no_number(tmp_path):
    whole, folder = finished(study_in(tmp_path / "whole")), study_in(tmp_path / "killed")
    for runs in (20, 120):  # 96 of the samples and the nominal scenario are run for each design
        killed_after(folder, runs)
    assert not (folder / "s.holdfast" / "robust.json").exists()
    assert finished(folder) == whole
    assert ended(folder, "ok") == ended(tmp_path / "whole", "ok")
    assert whole["nominal"] == {"u": 0.5}
    assert whole["left_out"] > 0
