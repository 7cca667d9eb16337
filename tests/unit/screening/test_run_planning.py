"""How many runs: simulated recovery, its interval, and the advice."""

import json
from pathlib import Path

import numpy as np
import pytest

from surrogates.screening.planning import random_function, recovery, wilson_interval
from workbench.errors import StudyError
from workbench.screening.run_planning import MEASURED, plan_runs, run_plan_lines


def uniform(n, d, rng):
    return rng.random((n, d))


def test_random_functions_have_unit_spread_and_only_active_inputs():
    rng = np.random.default_rng(0)
    for k in (1, 3, 6):
        f = random_function(k, rng=rng)
        x = rng.random((4000, k))
        assert f(x).std() == pytest.approx(1.0, abs=0.05)
        for i in range(k):
            moved = x.copy()
            moved[:, i] = rng.random(4000)
            assert np.var(f(moved) - f(x)) > 0.003  # every input acts


def test_wilson_interval_holds_the_share_and_stays_inside():
    for s, n in ((0, 10), (10, 10), (7, 60)):
        low, high = wilson_interval(s, n)
        assert 0 <= low <= s / n <= high <= 1


def test_more_runs_find_more():
    rows = recovery(8, 3, [10, 45], sampler=uniform, trials=8, rng=np.random.default_rng(1))
    assert rows[0].exact <= rows[1].exact
    assert rows[1].first >= 0.6
    assert rows[1].missed < rows[0].missed


def test_own_function():
    rows = recovery(
        5,
        2,
        [25],
        sampler=uniform,
        trials=3,
        function=lambda x: x[:, 0] + x[:, 1],
        rng=np.random.default_rng(1),
    )
    assert rows[0].exact == 1.0


def test_plan_stops_at_the_target_and_says_so():
    plan = plan_runs(6, 2, trials=5, seed=1, target=0.6)
    assert plan.runs == plan.table[-1].n
    assert plan.advice.startswith(f"plan {plan.runs} runs for 6 parameters with about 2 that matter")
    json.dumps(plan.to_dict(), allow_nan=False)
    assert list(plan.to_frame().index) == [row.n for row in plan.table]
    short = plan_runs(10, 6, runs=[8], trials=4)
    assert short.runs is None
    assert "8 runs are not enough" in short.advice


def test_the_advice_is_not_below_what_the_verdict_needs():
    plan = plan_runs(8, 2, trials=4)
    assert plan.needed == 26
    assert plan.runs >= plan.needed > plan.found_from
    assert plan.table[0].resolved == 0.0
    assert f"plan {plan.runs} runs" in plan.advice
    assert "with fewer than 26 runs (10, and 2 per parameter) no screening is called resolved" in plan.advice
    few = plan_runs(8, 2, runs=[20], trials=4)
    assert (few.runs, few.found_from) == (None, 20)
    assert few.advice.startswith("20 runs find them for 8 parameters with about 2 that matter: ")
    assert few.advice.endswith("no screening is called resolved: plan at least 26")
    assert "plan 30 or more" in plan_runs(10, 6, runs=[8], trials=2).advice


def test_the_rates_measured_on_welchs_function_are_those_of_the_documentation():
    page = (Path(__file__).parents[3] / "docs/explanation/sampler-question.md").read_text()
    for n, found, tried in MEASURED:
        sampler = "IHS" if n == 40 else "LHS"
        row = next(
            line for line in page.splitlines() if line.startswith(f"| {sampler} | {n} | ") and "200" in line
        )
        assert row.split("|")[4].startswith(f" {found} of {tried} ")
    plan = plan_runs(20, 6, runs=[50], trials=1)
    assert "194 of 200 samples of 50 runs" in plan.measured
    assert plan.measured in run_plan_lines(plan.to_dict())
    assert plan_runs(5, 2, runs=[20], trials=1).measured == ""


def test_impossible_plans_are_refused():
    for noise in (np.inf, np.nan, -0.1):
        with pytest.raises(
            StudyError, match=r"noise needs a finite number >= 0, relative to the response, got"
        ):
            plan_runs(4, 2, noise=noise)
    with pytest.raises(StudyError, match=r"plan needs at least 1 trial, got 0"):
        plan_runs(4, 2, trials=0)
    with pytest.raises(StudyError, match=r"a screening needs at least 3 runs, got 2 to try"):
        plan_runs(4, 2, runs=[20, 2])
    with pytest.raises(StudyError, match=r"1 <= active <= inputs, got active=9 and inputs=4"):
        plan_runs(4, 9)
    with pytest.raises(StudyError, match=r"at most 60 inputs, got 200"):
        plan_runs(200, 6)
    with pytest.raises(StudyError, match=r"target needs a share between 0 and 1, got 1.0"):
        plan_runs(4, 2, target=1.0)
    with pytest.raises(ValueError, match=r"needs 1 <= k <= d, got k=5 and d=4"):
        recovery(4, 5, [20], sampler=uniform, rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"trials needs at least 1, got 0"):
        recovery(4, 2, [20], sampler=uniform, trials=0, rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"k needs at least 1 active input, got 0"):
        random_function(0, rng=np.random.default_rng(0))
