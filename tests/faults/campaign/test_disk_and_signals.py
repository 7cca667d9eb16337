"""A full or read-only disk ends a campaign with exit code 5, a signal with 4; both continue later."""

import os
import resource
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

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
[design]
kind = "sobol"
runs = {runs}
"""
CODE = "import time\ndef f(a):\n    time.sleep({pause})\n    return a / 3\n"


def write_study(folder, *, runs, pause):
    (folder / "m.py").write_text(CODE.format(pause=pause))
    (folder / "s.toml").write_text(STUDY.format(runs=runs))
    return folder / "s.toml"


def start(study, *options, file_limit=None, in_background=False):
    def before():
        # a script's background jobs ignore SIGINT; the tests may be one
        signal.signal(signal.SIGINT, signal.SIG_IGN if in_background else signal.SIG_DFL)
        if file_limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (file_limit, file_limit))

    return subprocess.Popen(
        [sys.executable, "-m", "workbench", "run", str(study), *options],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=before,
    )


def answers(study):
    db = sqlite3.connect(study.with_suffix(".holdfast") / "runs.sqlite")
    assert db.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    found = dict(db.execute("SELECT key, outputs FROM evaluation WHERE status = 'ok'").fetchall())
    running = db.execute("SELECT COUNT(*) FROM evaluation WHERE status = 'running'").fetchone()[0]
    db.close()
    return found, running


def wait_for_answers(study, count, process):
    until = time.monotonic() + 60
    path = study.with_suffix(".holdfast") / "runs.sqlite"
    while time.monotonic() < until and process.poll() is None:
        if path.exists() and count_of_ok(path) >= count:
            return
        time.sleep(0.02)


def count_of_ok(path):
    db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    try:
        return db.execute("SELECT COUNT(*) FROM evaluation WHERE status = 'ok'").fetchone()[0]
    except sqlite3.Error:
        return 0  # the tables are being made
    finally:
        db.close()


@pytest.mark.slow
@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_four_and_nothing_is_repeated(tmp_path, signal_number):
    study = write_study(tmp_path, runs=40, pause=0.05)
    process = start(study, in_background=signal_number == signal.SIGTERM)
    wait_for_answers(study, 3, process)
    process.send_signal(signal_number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 4, err
    assert "the same command continues" in err
    assert "Traceback" not in err
    before, running = answers(study)
    assert 3 <= len(before) < 40
    assert running == 0
    if signal_number == signal.SIGTERM:
        return
    process = start(study)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert f"40 runs, {len(before)} of them known" in err
    after, _ = answers(study)
    assert len(after) == 40
    assert {key: after[key] for key in before} == before


MODELLED = (
    STUDY.replace("runs = {runs}", "runs = 60")
    + """
[[parameter]]
name = "b"
lower = 0
upper = 1
[screen]
response = "y"
[worst_case]
response = "y"
budget = 30
"""
)


@pytest.mark.parametrize(
    ("signal_number", "stage"),
    [
        (signal.SIGINT, "screen"),
        (signal.SIGTERM, "screen"),
        pytest.param(signal.SIGINT, "worst case", marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, "worst case", marks=pytest.mark.slow),
    ],
)
def test_a_signal_between_the_runs_is_four_too(tmp_path, signal_number, stage):
    (tmp_path / "m.py").write_text(
        "import math\ndef f(a, b):\n    return math.sin(9 * a) * math.cos(7 * b)\n"
    )
    study = tmp_path / "s.toml"
    study.write_text(MODELLED)
    process = start(study, in_background=signal_number == signal.SIGTERM)
    for line in process.stderr:
        if line.startswith(stage):
            break
    process.send_signal(signal_number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 4, err
    assert err.endswith("the same command continues\n")
    assert "Traceback" not in err
    assert out == ""
    before, running = answers(study)
    assert (len(before) >= 60, running) == (True, 0)
    if (stage, signal_number) == ("worst case", signal.SIGTERM):
        process = start(study)
        out, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
        assert "60 runs, 60 of them known" in err
        assert "report:" in out


@pytest.mark.slow
def test_a_full_disk_is_five_and_the_rest_follows_later(tmp_path):
    study = write_study(tmp_path, runs=600, pause=0)
    process = start(study, file_limit=150_000)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 5, (process.returncode, err)
    assert "it continues from what is stored" in err or "cannot write" in err
    assert "Traceback" not in err
    before, _ = answers(study)
    process = start(study)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    after, _ = answers(study)
    assert len(after) == 600
    assert {key: after[key] for key in before} == before


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 500 kB; only the super-user can make one."""
    place = tmp_path / "disk"
    place.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=500k", "tmpfs", str(place)], capture_output=True, check=False
    )
    if made.returncode != 0:
        pytest.skip("mounting a file system needs the rights of the super-user")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def remount(place, options):
    subprocess.run(["mount", "-o", f"remount,{options}", str(place)], check=True)


@pytest.mark.slow
def test_a_disk_that_fills_up_and_one_that_turns_read_only(tmp_path, small_disk):
    study = write_study(tmp_path, runs=600, pause=0)
    folder = small_disk / "c"
    database = tmp_path / "s.holdfast"
    database.symlink_to(folder)  # where `answers` looks
    process = start(study, "--folder", str(folder))
    _, err = process.communicate(timeout=120)
    assert process.returncode == 5, (process.returncode, err)
    assert "Traceback" not in err
    remount(small_disk, "size=20m")
    before, _ = answers(study)
    assert 0 < len(before) < 600
    remount(small_disk, "ro")
    process = start(study, "--folder", str(folder))
    _, err = process.communicate(timeout=120)
    assert process.returncode == 5, (process.returncode, err)
    assert "cannot write in" in err or "read-only" in err.lower()
    assert "Traceback" not in err
    remount(small_disk, "rw")
    process = start(study, "--folder", str(folder))
    _, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    after, _ = answers(study)
    assert len(after) == 600
    assert {key: after[key] for key in before} == before


def test_a_place_that_cannot_be_written_is_five(tmp_path):
    study = write_study(tmp_path, runs=4, pause=0)
    for place in ("/proc/holdfast", "/dev/null/holdfast"):
        process = start(study, "--folder", place)
        _, err = process.communicate(timeout=60)
        assert process.returncode == 5, err
        assert f"cannot make the folder {place}" in err
    if os.geteuid() != 0:
        (tmp_path / "fixed").mkdir(mode=0o500)
        process = start(study, "--folder", str(tmp_path / "fixed"))
        _, err = process.communicate(timeout=60)
        assert process.returncode == 5, err


def test_two_at_once_is_five(tmp_path):
    study = write_study(tmp_path, runs=1000, pause=0.1)  # longer than a second process takes to start
    first = start(study)
    try:
        wait_for_answers(study, 1, first)
        second = start(study)
        _, err = second.communicate(timeout=60)
    finally:
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=60)
    assert second.returncode == 5, err
    assert "is in use by another holdfast" in err
