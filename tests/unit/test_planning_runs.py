"""How many runs: simulated recovery, its interval, and the advice."""

import json

import numpy as np
import pytest

from surrogates.planning import random_function, recovery, wilson_interval
from workbench.errors import StudyError
from workbench.run_planning import plan_runs


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


def test_impossible_plans_are_refused():
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
