"""SIGKILL of the coordinator, at random and before every database operation: nothing acknowledged is lost."""

import ast
import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.faults.seeds import SHIFT
from workbench.histories.store import HistoryStore
from workbench.system.processes.process_tree import marked_processes

DRIVER = Path(__file__).with_name("kill_driver.py")
ROOT = DRIVER.parent.parent.parent
GONE_WITHIN = 5.0  # s: the promise for processes of a killed coordinator


class Forks:
    """Coordinators that are forks of one process, one after the other; see `kill_driver.py`."""

    def __init__(self):
        self._server = subprocess.Popen(
            [sys.executable, str(DRIVER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
            env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT)},
            text=True,
        )

    def close(self):
        self._server.communicate()  # the end of its input is its end
        assert self._server.returncode == 0

    def start(self, folder, count, engine, kill_after=0, what="database"):
        """Begin one; the last has ended."""
        self._number = self._asked([str(folder), count, engine, kill_after, what])
        self._code = None

    def kill(self):
        os.kill(self._number, signal.SIGKILL)
        assert self.wait() == -signal.SIGKILL

    def poll(self):
        self._code = self._asked("poll") if self._code is None else self._code
        return self._code

    def wait(self):
        self._code = self._asked("wait") if self._code is None else self._code
        return self._code

    def _asked(self, what):
        self._server.stdin.write(json.dumps(what) + "\n")
        self._server.stdin.flush()
        return json.loads(self._server.stdout.readline())


@pytest.fixture(scope="module")
def forks():
    forks = Forks()
    yield forks
    forks.close()


def results(folder):
    """What the finished campaign says about every row, times left out."""
    db = sqlite3.connect(folder / "runs.sqlite")
    found = db.execute("SELECT key, status, inputs, outputs, error FROM evaluation ORDER BY id").fetchall()
    assert db.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    db.close()
    return found


def assert_acknowledged(folder):
    """Every acknowledged row is in the database as it was acknowledged, with its time: made once."""
    path = folder / "acknowledged"
    lines = path.read_text().splitlines() if path.exists() else []
    db = sqlite3.connect(folder / "runs.sqlite")
    for line in lines:
        key, status, finished, outputs = line.split(" ", 3)
        row = db.execute("SELECT status, finished, outputs FROM evaluation WHERE key = ?", (key,)).fetchone()
        assert row is not None
        assert (row[0], row[1]) == (status, float(finished))
        assert ({} if row[2] is None else json.loads(row[2])) == ast.literal_eval(outputs)
    db.close()
    return len(lines)


def uninterrupted(forks, folder, count, engine="inline"):
    forks.start(folder, count, engine)
    assert forks.wait() == 0
    return results(folder)


def killed_and_resumed(forks, folder, count, engine, kills, seed):
    """Kill the coordinator `kills` times at random moments of its work, resuming in between; then finish."""
    rng = random.Random(seed)
    done_at_kill = []
    for _ in range(kills):
        forks.start(folder, count, engine)
        # wait until it has acknowledged something new, then a random while more: the kill meets it at work
        path = folder / "acknowledged"
        before = path.stat().st_size if path.exists() else 0
        until = time.monotonic() + 60
        while forks.poll() is None and time.monotonic() < until:
            if path.exists() and path.stat().st_size > before:
                break
            time.sleep(0.002)
        time.sleep(rng.uniform(0, 0.03))
        if forks.poll() is not None:
            break
        forks.kill()
        done_at_kill.append(assert_acknowledged(folder))
    forks.start(folder, count, engine)
    assert forks.wait() == 0
    assert_acknowledged(folder)
    return done_at_kill


@pytest.mark.parametrize("engine", ["inline", "processes"])
def test_twenty_kills_lose_nothing(forks, tmp_path, engine):
    whole = uninterrupted(forks, tmp_path / "whole", 200, engine)
    kills = killed_and_resumed(
        forks, tmp_path / "killed", 200, engine, 20 if engine == "inline" else 6, seed=1
    )
    assert len(kills) >= 4  # it was at work when it was killed
    assert results(tmp_path / "killed") == whole
    deadline = time.monotonic() + GONE_WITHIN
    while left_behind(tmp_path) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert left_behind(tmp_path) == []


def left_behind(folder):
    """Worker processes that still stand in the folder."""
    found = []
    for pid in marked_processes(""):
        try:
            place = Path(f"/proc/{pid}/cwd").readlink()
        except OSError:
            continue
        if place.is_relative_to(folder):
            found.append(pid)
    return found


def assert_histories(folder):
    """Every run that has its answer has its history, whole, and no more is in the file."""
    with HistoryStore.reading(folder) as store:
        assert store.wrong() == []
        found = {e.key: store.history(e) for e in store.entries(name="y")}
    rows = [row for row in results(folder) if row[1] == "ok"]
    assert len(rows) == len(results(folder))
    assert found.keys() == {key for key, *_ in rows}
    for key, _, inputs, outputs, _ in rows:
        a, b = json.loads(inputs).values()
        assert found[key].values.tolist() == [a * k + b * k * k for k in range(600)]
        assert max(found[key].values) == json.loads(outputs)["y"]


def kill_before_some_with_histories(forks, operations, tmp_path, count, what):
    reached = kill_before_every(forks, operations, tmp_path, count, what, engine="histories")
    for folder in tmp_path.iterdir():
        assert_histories(folder)
    return reached


@pytest.mark.parametrize(("what", "step"), [("database", 37), ("files", 43)])
def test_a_kill_leaves_no_answer_without_its_history(forks, tmp_path, what, step):
    assert kill_before_some_with_histories(forks, range(3, 400, step), tmp_path, 6, what) is not None


@pytest.mark.slow
@pytest.mark.parametrize("what", ["database", "files"])
def test_a_kill_before_every_operation_leaves_no_answer_without_its_history(forks, tmp_path, what):
    last = kill_before_some_with_histories(forks, range(1, 2000), tmp_path, 12, what)
    assert last is not None
    assert last > 30


@pytest.mark.slow
@pytest.mark.count
def test_two_hundred_kills_lose_nothing(forks, tmp_path):
    whole = uninterrupted(forks, tmp_path / "whole", 2000)
    kills = killed_and_resumed(forks, tmp_path / "killed", 2000, "inline", 200, seed=SHIFT + 2)
    assert len(kills) >= 150
    assert results(tmp_path / "killed") == whole


def kill_before_every(forks, operations, tmp_path, count, what="database", engine="inline"):
    whole = uninterrupted(forks, tmp_path / "whole", count, engine)
    for k in operations:
        folder = tmp_path / f"k{k}"
        forks.start(folder, count, engine, k, what)
        code = forks.wait()
        if code == 0:
            return k
        assert code == -signal.SIGKILL
        forks.start(folder, count, engine)
        assert forks.wait() == 0
        assert_acknowledged(folder)
        assert results(folder) == whole
    return None


def test_a_kill_before_every_third_database_operation(forks, tmp_path):
    assert kill_before_every(forks, range(2, 400, 6), tmp_path, 12) is not None


@pytest.mark.slow
def test_a_kill_before_every_database_operation(forks, tmp_path):
    last = kill_before_every(forks, range(1, 2000), tmp_path, 25)
    assert last is not None
    assert last > 30


@pytest.mark.slow
def test_a_kill_before_some_operations_on_files(forks, tmp_path):
    assert kill_before_every(forks, range(1, 400, 23), tmp_path, 6, what="files") is not None


@pytest.mark.slow
def test_a_kill_before_every_operation_on_files(forks, tmp_path):
    last = kill_before_every(forks, range(1, 2000), tmp_path, 12, what="files")
    assert last is not None
    assert last > 30
