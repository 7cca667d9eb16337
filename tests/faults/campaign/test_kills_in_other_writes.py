"""SIGKILL in growth, rereading, a new version of the model, merging and recovery: nothing is lost.

Nothing acknowledged is gone, what is done again ends as if there had been no kill, to the last bit of answers
and histories, and the campaign that was merged is as it was.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.counted import counted

DRIVER = Path(__file__).with_name("kill_other_writes.py")
ROOT = DRIVER.parents[3]
SHORT = ("rereading", "merge", "recovery")
LONG = ("growth", "new version")  # minutes each; some of their operations are tried with the others


def killed(folder, work, what, first, step):
    done = subprocess.run(
        [sys.executable, str(DRIVER), str(folder), work, what, str(first), "100000", str(step)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT)},
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["wrong"] == [], done.stderr
    assert found["at_end"]
    assert found["before"] == 12
    assert found["histories"] > 8
    if work in ("growth", "new version", "merge"):
        assert found["after"] > 12
        assert found["changed"] == 0
    else:  # other values by another reading; a damaged answer that is gone
        assert found["changed"] == (1 if work == "recovery" else found["histories"])
    print(work, what, found)
    return found["kills"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("work", "what"),
    [("rereading", "database"), *((work, what) for work in LONG for what in ("database", "files"))],
)
def test_a_kill_in_another_write_loses_nothing(tmp_path, work, what):
    assert killed(tmp_path, work, what, 11, 50 if what == "database" else 40) >= 1


@pytest.mark.slow
@pytest.mark.parametrize(("what", "step"), [("database", 3), ("files", 1)])
@pytest.mark.parametrize("work", [*SHORT, *counted(LONG)])
def test_kills_in_other_writes_lose_nothing(tmp_path, work, what, step):
    """More than 200 kills in all."""
    assert killed(tmp_path, work, what, 1, step) >= 8
