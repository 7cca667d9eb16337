"""Campaigns of very many true runs of a cheap function: processor time and memory by the run.

Every command runs in a process of its own, so that its peak is its own. Two sizes give the slope.
"""

import os
import resource
import subprocess
import sys

import pytest

pytestmark = pytest.mark.bench

SIZES = (20_000, 60_000)
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
[[parameter]]
name = "c"
lower = 0
upper = 1
[[response]]
name = "y"
[design]
kind = "lhs"
runs = {runs}
[evaluate]
engine = "{engine}"
workers = 2
"""
CODE = "import math\ndef f(a, b, c):\n    return a * a + math.sin(3 * b) * c\n"


def measured(folder, *words):
    """Processor time in s of a command with its workers, and the peak in MB of the largest process."""
    code = (
        "import resource, sys\n"
        "from workbench.terminal.cli import main\n"
        "try:\n    main()\nfinally:\n"
        "    u = [resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]\n"
        "    print(max(x.ru_maxrss for x in u) / 1e3, file=sys.stderr)\n"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=folder, capture_output=True, text=True, check=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, float(ended.stderr.split()[-1])


@pytest.mark.timeout(1200)
@pytest.mark.parametrize("engine", ["inline", "processes"])
def test_many_true_runs(tmp_path, engine):
    found = {}
    for runs in SIZES:
        folder = tmp_path / str(runs)
        folder.mkdir()
        (folder / "m.py").write_text(CODE)
        (folder / "s.toml").write_text(STUDY.format(runs=runs, engine=engine))
        found["all of it", runs] = measured(folder, "run", "s.toml")
        found["report and exports", runs] = measured(folder, "report", "s.toml")
        (folder / "s.holdfast" / ".settled.json").unlink()
        found["run again, everything known", runs] = measured(folder, "run", "s.toml")
        found["run again, settled", runs] = measured(folder, "run", "s.toml")
    few, many = SIZES
    print(f"\n{engine}, load {os.getloadavg()[0]:.1f}")
    for what in dict.fromkeys(name for name, _ in found):
        (cpu, peak), (more, higher) = found[what, few], found[what, many]
        per_run, per_run_kb = (more - cpu) / (many - few), (higher - peak) / (many - few)
        print(f"{what}, {many} runs   {more:.2f} s")
        print(
            f"    peak {higher:.0f} MB; {1e6 * per_run:.1f} us and {1e3 * per_run_kb:.2f} kB more by the run"
        )
