"""The processor time of a run is that of the solver which it started, not that of whoever waits for it."""

import subprocess
import sys
import time

import pytest

from workbench.stages.campaign import Campaign
from workbench.system.processes.processor_time import processor_time, time_of_tree

BURNT = 0.3  # s, by the solver's own account
TICKS = 0.05  # s: what a living process has taken is told in steps of 10 ms, some of them one after the other
STUDY = """
[study]
name = "s"
[model]
kind = "command"
command = ["{{python}}", "{{study}}/solve.py", "{{a}}"]
[[parameter]]
name = "a"
lower = 0
upper = 10
[[response]]
name = "y"
read = {{ kind = "json", file = "out.json", key = "y" }}
[evaluate]
{evaluate}
"""
SOLVER = f"""
import json, sys, time
a = float(sys.argv[1])
while time.process_time() < {BURNT}: pass
if a > 5: time.sleep(600)
open("out.json", "w").write(json.dumps({{"y": a}}))
"""


def campaign_of(folder, evaluate):
    (folder / "solve.py").write_text(SOLVER)
    (folder / "s.toml").write_text(STUDY.format(evaluate=evaluate))
    return Campaign.from_file(folder / "s.toml")


@pytest.mark.parametrize("evaluate", ['engine = "inline"', "workers = 2"])
def test_the_time_of_a_command_counts_for_its_run(tmp_path, evaluate):
    with campaign_of(tmp_path, evaluate) as campaign:
        rows = campaign.evaluate([{"a": float(k)} for k in range(3)])
    assert all(BURNT <= row.cpu <= row.wall + 0.1 for row in rows), [(row.cpu, row.wall) for row in rows]


def test_the_time_of_a_command_that_was_stopped_counts_too(tmp_path):
    with campaign_of(tmp_path, "timeout = 3.0\nworkers = 1") as campaign:
        good, late = campaign.evaluate([{"a": 1.0}, {"a": 9.0}])
    assert (good.status, late.status) == ("ok", "timeout")
    assert BURNT - TICKS <= late.cpu < 3.0


def test_children_count_once_they_were_waited_for():
    before = processor_time()
    code = f"import time\nwhile time.process_time() < {BURNT}: pass\nprint('done', flush=True)\ninput()"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout.readline() == "done\n"
        assert time_of_tree(child.pid) >= BURNT - TICKS
        child.communicate("\n")
    assert processor_time() - before >= BURNT
    assert time_of_tree(child.pid) == 0.0
    assert time.process_time() <= processor_time()
