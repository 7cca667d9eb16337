"""The robust loop killed at any moment goes on to the numbers of an undisturbed one, with 1 or 2 workers."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.sample_layout import STUDY

ROOT = Path(__file__).parents[3]
KILLS = (2.5, 4.0, 5.5, 7.0)  # s after the start: imports, first searches, later rounds


def started(study):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "workbench", "run", str(study)]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
    )


def finished(study):
    process = started(study)
    _, error = process.communicate(timeout=300)
    assert process.returncode == 0, error.decode()
    folder = study.parent / "two.holdfast"
    return {
        name: json.loads((folder / f"{name}.json").read_text())
        for name in ("robust_layout", "robust", "layout")
    }


def study_in(folder, text=STUDY):
    folder.mkdir()
    (folder / "two.toml").write_text(text)
    return folder / "two.toml"


@pytest.mark.slow
def test_kills_change_no_number(tmp_path):
    whole = finished(study_in(tmp_path / "whole"))
    study, killed = study_in(tmp_path / "killed"), 0
    for seconds in KILLS:
        process = started(study)
        try:
            process.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            killed += 1
        process.communicate()
        time.sleep(0.1)
    assert killed > 0
    assert finished(study) == whole


@pytest.mark.slow
def test_two_workers_give_the_numbers_of_one(tmp_path):
    one, two = (
        finished(study_in(tmp_path / str(n), STUDY.replace('engine = "inline"', f"workers = {n}")))
        for n in (1, 2)
    )
    assert one == two
