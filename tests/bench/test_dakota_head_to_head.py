"""The same 200-evaluation command-line study in holdfast and in Dakota: 5 % failures, one SIGKILL halfway.

Counted: how many evaluations each has in the end, how many were run twice, and what stands where runs failed.
"""

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.bench

COUNT = 200
ROOT = Path(__file__).parent.parent.parent
# y = 3 a + b, but a run in twenty fails; every call leaves a line
SOLVER = """#!/bin/sh
a=$1; b=$2
echo "$a $b" >> "$CALLS"
awk -v a="$a" -v b="$b" 'BEGIN { if (int(a * 1000) % 20 == 7) exit 1; printf "%.17g\\n", 3 * a + b }'
"""
DRIVER = """#!/bin/sh
a=$(awk '$2 == "a" { print $1 }' "$1"); b=$(awk '$2 == "b" { print $1 }' "$1")
if y=$("$HERE/solver.sh" "$a" "$b"); then echo "$y y" > "$2"; else echo FAIL > "$2"; fi
"""
DAKOTA = """
environment
  tabular_data
    tabular_data_file = 'table.dat'
method
  sampling
    sample_type lhs
    samples = {count}
    seed = 17
variables
  uniform_uncertain = 2
    lower_bounds 0 0
    upper_bounds 1 1
    descriptors 'a' 'b'
interface
  fork
    analysis_drivers = '{driver}'
    parameters_file 'p.in'
    results_file 'r.out'
  {failure}
responses
  response_functions = 1
  descriptors 'y'
  no_gradients
  no_hessians
"""
STUDY = """
[study]
name = "s"
[model]
kind = "command"
command = ["sh", "{study}/solver.sh", "{a}", "{b}"]
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
read = { kind = "regex", file = "output.log", pattern = "(.+)" }
"""


def calls(folder):
    path = folder / "calls"
    lines = path.read_text().splitlines() if path.exists() else []
    return len(lines), len(lines) - len(set(lines))


def start(command, folder):
    environment = {**os.environ, "CALLS": str(folder / "calls"), "HERE": str(folder)}
    return subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def kill_halfway_and_resume(command, again, folder):
    process = start(command, folder)
    until = time.monotonic() + 120
    while calls(folder)[0] < COUNT // 2 and process.poll() is None and time.monotonic() < until:
        time.sleep(0.01)
    stopped_itself = process.poll() is not None
    process.send_signal(signal.SIGKILL)
    process.wait()
    start(again, folder).wait(240)
    return stopped_itself


def dakota(folder, failure):
    folder.mkdir()
    for name, text in (("solver.sh", SOLVER), ("driver.sh", DRIVER)):
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    (folder / "d.in").write_text(DAKOTA.format(count=COUNT, driver=folder / "driver.sh", failure=failure))
    program = str(Path(sys.executable).parent / "dakota")
    command = [program, "-i", "d.in", "-w", "d.rst"]
    kill_halfway_and_resume(command, [program, "-i", "d.in", "-r", "d.rst", "-w", "e.rst"], folder)
    table = folder / "table.dat"
    rows = [line.split() for line in table.read_text().splitlines()[1:]] if table.exists() else []
    made_up = sum(abs(float(row[-1])) > 1e3 for row in rows)
    return len(rows), made_up, 0, *calls(folder)


def holdfast(folder):
    folder.mkdir()
    (folder / "solver.sh").write_text(SOLVER)
    (folder / "s.toml").write_text(STUDY)
    code = (
        "import numpy as np; from scipy.stats import qmc; from workbench import Campaign\n"
        f"u = qmc.LatinHypercube(2, rng=np.random.default_rng(17)).random({COUNT})\n"
        "with Campaign.from_file('s.toml') as c: c.evaluate(c.study.space.rows(u))"
    )
    command = [sys.executable, "-c", f"import sys; sys.path.append({str(ROOT)!r})\n{code}"]
    kill_halfway_and_resume(command, command, folder)
    db = sqlite3.connect(folder / "s.holdfast" / "runs.sqlite")
    statuses = dict(db.execute("SELECT status, COUNT(*) FROM evaluation GROUP BY status"))
    db.close()
    return statuses.get("ok", 0) + statuses.get("failed", 0), 0, statuses.get("failed", 0), *calls(folder)


def test_what_each_loses(tmp_path):
    if not shutil.which("dakota", path=str(Path(sys.executable).parent)):
        pytest.skip("dakota is not installed beside this Python")
    rows = [
        ("Dakota, failures abort (default)", dakota(tmp_path / "abort", "")),
        ("Dakota, failures recover = 1e9", dakota(tmp_path / "recover", "failure_capture recover = 1e9")),
        ("holdfast", holdfast(tmp_path / "holdfast")),
    ]
    head = ("evaluations on record", "made-up values", "told as failed", "calls", "made twice")
    print(
        f"\n{COUNT} evaluations, 5 % fail, one SIGKILL at half\n{'':<34}" + "".join(f"{h:>23}" for h in head)
    )
    for name, values in rows:
        print(f"{name:<34}" + "".join(f"{v:>23}" for v in values))
