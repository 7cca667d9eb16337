"""Corners are run before a search ends: kept back where they are few, else run where all fit."""

from math import exp

import numpy as np
import pytest

from workbench.search import loop
from workbench.search.proposals.corners import FINISHING_RUNS, CornerPlan
from workbench.search.proposals.portfolio import Batch
from workbench.search.runs.ledger import Ledger
from workbench.search.worst_case import Status, worst_case
from workbench.space.box import Parameter, Space


def box(d, **more):
    return Space([Parameter(name, lower=0.0, upper=1.0) for name in "abcdefgh"[:d]], **more)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("width", [0.02, 0.08])
def test_a_peak_in_a_corner_that_no_run_came_near_is_found(width, seed):
    found = worst_case(
        lambda a, b: a + 1.5 * exp(-(a * a + (1 - b) ** 2) / width), box(2), budget=60, seed=seed
    )
    assert found.value >= 1.5
    assert found.evaluations <= 60
    assert found.audit.sentences[0] == "all 4 corners were run"


@pytest.mark.slow
def test_a_step_in_a_corner_is_found():
    found = worst_case(lambda a, b: float(a > 0.6) + 2.0 * (a < 0.2 and b > 0.75), box(2), budget=40, seed=0)
    assert found.value == 2.0


def test_the_last_runs_come_after_the_corners_kept_back():
    found = worst_case(lambda a, b: -((a - 0.4) ** 2) - (b - 0.6) ** 2, box(2), budget=24, tolerance=-1)
    names = [run.proposal for run in found.runs]
    corners = [i for i, name in enumerate(names) if name == "corner"]
    assert corners
    assert corners[-1] == len(names) - FINISHING_RUNS - 1
    assert found.evaluations == 24


@pytest.mark.slow
def test_batches_leave_the_corners_their_runs():
    found = worst_case(
        lambda a, b: -((a - 0.4) ** 2) - (b - 0.6) ** 2, box(2), budget=25, workers=4, tolerance=-1
    )
    assert found.evaluations == 25
    assert found.audit.corners_run == 4


@pytest.mark.parametrize(("budget", "reserved"), [(15, False), (16, True), (60, True)])
def test_corners_are_kept_back_where_they_are_a_quarter_of_the_budget_at_most(budget, reserved):
    ledger = Ledger.opened(box(2), response=None, sense="max", start=(), progress=None)
    assert CornerPlan.of(ledger, budget=budget).reserved is reserved


@pytest.mark.slow
@pytest.mark.parametrize(("budget", "all_fit"), [(100, True), (56, False)])
def test_a_search_that_ends_early_runs_the_corners_where_all_fit(budget, all_fit):
    found = worst_case(
        lambda **x: sum((i + 1) * value for i, value in enumerate(x.values())), box(5), budget=budget, seed=0
    )
    tried = sum(run.proposal == "corner" for run in found.runs)
    assert found.value == 15.0
    assert found.status is Status.CONVERGED
    assert found.evaluations < budget
    if all_fit:
        assert found.audit.sentences[0] == "all 32 corners were run"
    else:
        assert tried == 0
        assert f"{found.audit.corners_run} of 32 corners were run" in found.audit.sentences[0]


@pytest.mark.slow
def test_a_corner_that_is_worse_begins_the_search_anew():
    found = worst_case(lambda a, b: float(a > 0.9 and b > 0.9), box(2), budget=30, seed=0)
    names = [run.proposal for run in found.runs]
    last = max(i for i, name in enumerate(names) if name == "corner")
    assert found.value == 1.0
    assert len(names) > last + 1
    assert found.status is Status.BUDGET or found.gap.width <= 1e-3


@pytest.mark.slow
def test_corners_that_break_a_constraint_are_no_corners():
    found = worst_case(lambda a, b: a - b, box(2, constraints=("a + b <= 1.5",)), budget=30, seed=0)
    assert found.audit.corners == 3
    assert found.audit.sentences[0] == "all 3 corners were run"


@pytest.mark.slow
def test_a_corner_that_failed_is_named():
    def brittle(a, b):
        if a > 0.9 and b > 0.9:
            raise RuntimeError("diverged")
        return a - b

    found = worst_case(brittle, box(2), budget=30, seed=0)
    assert found.audit.sentences[0] == "3 of 4 corners gave a value; 1 more failed and may be worse"


@pytest.mark.slow
@pytest.mark.parametrize("value", [0.0, 7.3e5])
def test_a_constant_response_is_said_to_be_constant(value):
    found = worst_case(lambda a, b: value, box(2), budget=60, seed=0)
    assert found.status is Status.CONSTANT
    assert found.evaluations == 20  # ten runs per parameter
    assert found.audit.corners_run == 4
    assert "all 20 runs gave the same value: the response does not depend on" in found.gap.note
    assert found.to_dict()["status"] == "every run gave the same value"
    assert found.gap.sentence.startswith("No bound is known on how much worse it could be: all 20 runs gave")
    assert found.gap.sentence.endswith("or no run met the region where it changes.")


def test_a_response_that_moves_a_little_is_not_constant():
    found = worst_case(lambda a, b: 1e6 + 1e-3 * a, box(2), budget=12, seed=0)
    assert found.status is not Status.CONSTANT
    assert np.ptp(found.history) > 0


def nothing_proposed(known, *args, **kwargs):
    none = np.empty(0)
    return Batch(u=np.empty((0, known.where.dimension)), proposals=(), predicted=none, std=none)


def test_without_a_proposal_the_space_is_filled_while_the_gap_is_wide(monkeypatch):
    monkeypatch.setattr(loop, "propose", nothing_proposed)
    found = worst_case(lambda a, b: float(np.sin(9 * a) + np.cos(7 * b)), box(2), budget=14)
    names = [run.proposal for run in found.runs]
    assert found.evaluations == 14
    assert found.status is Status.BUDGET
    assert names == ["start"] * 4 + ["fill"] * 10


def test_a_search_that_finds_no_further_point_says_so(monkeypatch):
    monkeypatch.setattr(loop, "propose", nothing_proposed)
    monkeypatch.setattr(loop, "far_points", lambda where, u, **k: u[:0])
    found = worst_case(lambda a, b: float(np.sin(9 * a) + np.cos(7 * b)), box(2), budget=14)
    assert found.status is Status.NO_POINT
    assert found.evaluations == 4
