"""The audit of a worst case counts the runs of the search and those of an attack beside it."""

import numpy as np

from workbench.search.evidence.audit import audit_runs
from workbench.search.evidence.gap import Gap
from workbench.search.runs.given_runs import Run
from workbench.search.runs.ledger import Ledger
from workbench.space.box import Parameter, Space

BOX = Space([
    Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0),
    Parameter("kind", kind="categorical", levels=["x", "y"]),
])  # fmt: skip


NONE = Gap(upper=2.0, width=0.0, coverage=0.95, kind="model-based")


def attack_run(a, b, kind, value, status="ok"):
    return Run(
        key=f"{a}{b}{kind}", number=1, proposal="attack: corners", status=status, value=value, predicted=None,
        std=None, parameters={"a": a, "b": b, "kind": kind}, outputs={}, error="",
    )  # fmt: skip


def opened():
    start = [{"a": a, "b": 0.5, "kind": "x", "v": a} for a in (0.2, 0.5, 0.8)]
    start.append({"a": 1.0, "b": 1.0, "kind": "x", "v": 2.0})
    return Ledger.opened(BOX, response="v", sense="max", start=start, progress=None)


def test_corners_of_an_attack_are_counted_once_and_failed_ones_apart():
    unseen = (
        attack_run(0.0, 1.0, "x", 1.0), attack_run(0.0, 1.0, "x", 1.0), attack_run(1.0, 1.0, "x", 2.0),
        attack_run(1.0, 0.0, "y", None, "failed"), attack_run(0.0, 0.0, "y", None, "excluded"),
    )  # fmt: skip
    alone = audit_runs(opened(), None, gap=NONE, rng=np.random.default_rng(0))
    assert (alone.corners, alone.corners_run, alone.corners_failed) == (8, 1, 0)
    told = audit_runs(opened(), None, gap=NONE, unseen=unseen, rng=np.random.default_rng(0))
    assert (told.corners, told.corners_run, told.corners_failed) == (8, 2, 1)
    assert "2 of 8 corners were run" in told.sentences[0]
    assert "1 more failed and may be worse" in told.sentences[0]


def test_the_point_that_is_reported_says_whether_it_is_a_corner():
    assert audit_runs(opened(), None, gap=NONE, rng=np.random.default_rng(0)).is_corner
    inside = audit_runs(
        opened(), None, gap=NONE, worst=np.array([0.5, 1.0, 0.0]), rng=np.random.default_rng(0)
    )
    assert not inside.is_corner
