"""The same study gives the same figures with one worker or four, and in whatever order runs finish."""

import random
import sqlite3

import numpy as np
import pytest

from workbench.campaign.supervisor import Policy, supervise
from workbench.models.protocol import Answer
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import run_stage

STUDY = """
[study]
name = "s"
seed = 4
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
kind = "sobol"
runs = 20
[evaluate]
workers = {workers}
[screen]
response = "y"
[worst_case]
response = "y"
budget = 6
batch = 2
"""
CODE = """
import math, time
def f(a, b, c):
    time.sleep(0.02 * (a > 0.5))  # some finish later than those that began after them
    if b > 0.95: raise ValueError("no value here")
    return math.sin(3 * a) + b * b + 1e-3 * c
"""


def results(folder, workers):
    folder.mkdir()
    (folder / "m.py").write_text(CODE)
    (folder / "s.toml").write_text(STUDY.format(workers=workers))
    with Campaign.from_file(folder / "s.toml") as campaign:
        design = run_stage(campaign, "design")
        evaluate(campaign)
        screening = run_stage(campaign, "screen")
        worst = run_stage(campaign, "worst_case")
        stages_of = [
            (r.id, r.key, r.status, dict(r.inputs), dict(r.outputs), r.error) for r in campaign.runs()
        ]
    return design, screening, worst, stages_of


@pytest.mark.slow
def test_one_two_and_four_workers(tmp_path):
    one, two, four = (results(tmp_path / str(n), n) for n in (1, 2, 4))
    assert one == two == four


class Shuffled:
    """An engine that answers in random order, some answers twice and some before they are asked for again."""

    capacity = 7

    def __init__(self, seed):
        self.rng = random.Random(seed)
        self.under_way = []
        self.told = []

    def submit(self, task, row, *, workdir=None):
        self.under_way.append((task, Answer(status="ok", outputs={"y": row["a"] / 3})))

    def completed(self, *, wait=None):
        self.rng.shuffle(self.under_way)
        done = [self.under_way.pop() for _ in range(self.rng.randint(1, len(self.under_way)))]
        again = self.rng.sample(
            self.told, min(len(self.told), 2)
        )  # late repetitions, as a cluster may deliver
        self.told += done
        return [*again, *done, *done[:1]]

    def close(self):
        pass


@pytest.mark.parametrize("seed", range(5))
def test_completion_in_any_order_with_repetitions(tmp_path, seed):
    rows = [{"a": float(x)} for x in np.linspace(0, 1, 50)]
    with Campaign.of(
        lambda a: a, Space([Parameter("a", lower=0, upper=1)]), folder=tmp_path / "c"
    ) as campaign:
        keys = campaign.enqueue(rows, batch="design")
        supervise(Shuffled(seed), campaign.store, keys, policy=Policy())
        found = campaign.store.rows(keys=keys)
        assert [row.outputs["y"] for row in found] == [row["a"] / 3 for row in rows]
        assert [row.id for row in found] == list(range(1, 51))
        assert {row.attempt for row in found} == {1}
        with sqlite3.connect(campaign.store.path) as db:
            assert db.execute("SELECT COUNT(*) FROM attempt").fetchone() == (0,)
        db.close()


def test_a_clock_that_jumps_changes_nothing(tmp_path, monkeypatch):
    clock = iter([5e9, 1.0, 3e9, 2.0] * 1000)
    monkeypatch.setattr("workbench.campaign.store.time.time", lambda: next(clock))
    with Campaign.of(
        lambda a: a, Space([Parameter("a", lower=0, upper=1)]), folder=tmp_path / "c"
    ) as campaign:
        rows = campaign.evaluate([{"a": k / 10} for k in range(10)])
    assert [row.outputs["y"] for row in rows] == [k / 10 for k in range(10)]
