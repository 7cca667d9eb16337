"""A comparison of designs some of whose runs fail: common scenarios, and what a failure may hide."""

import json

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns
from workbench.robust.failures import failure_warnings
from workbench.robust.re_evaluation import re_evaluate
from workbench.robust.statistics import quantile
from workbench.space.box import Parameter, Space

F = Space([Parameter("f", lower=0.0, upper=1.0, unit="N")])
SOFT_AND_STIFF = {"soft": {"k": 1.0, "holds": 1.0}, "stiff": {"k": 1.1, "holds": 0.7}}


def breaks(x, u):
    if u["f"] > x["holds"]:
        raise RuntimeError("no equilibrium")
    return x["k"] * u["f"]


def test_a_design_does_not_look_better_for_its_failures():
    """The stiff design is 1.1 times as bad everywhere and fails where it would be worst."""
    result = re_evaluate(breaks, SOFT_AND_STIFF, F, samples=100, limit=0.6)
    soft, stiff = result.summaries
    for name in ("mean", "worst"):
        assert getattr(stiff, name) == pytest.approx(1.1 * getattr(soft, name))
    for name, (value, _, _) in soft.quantiles.items():
        assert stiff.quantiles[name][0] == pytest.approx(1.1 * value)
    assert stiff.beyond_limit[0] > soft.beyond_limit[0]
    assert stiff.beyond_or_failed[0] > soft.beyond_or_failed[0] == pytest.approx(0.4)
    assert result.paired["stiff - soft"][0] == pytest.approx(stiff.mean - soft.mean)
    assert (soft.n, stiff.n, result.drawn, result.left_out) == (70, 70, 100, 30)
    assert soft.failed_share == (0.0, 0.0, pytest.approx(0.037, abs=1e-3))
    assert stiff.failed_share == (0.3, pytest.approx(0.219, abs=1e-3), pytest.approx(0.396, abs=1e-3))


def test_failures_where_others_are_bad_are_told():
    first, second = re_evaluate(breaks, SOFT_AND_STIFF, F, samples=100).warnings
    assert first.startswith(
        "stiff gave no value in 30 of 100 scenarios (30 %, 95 % interval 21.9 to 39.6 %), and fails where "
        "soft is bad (median 0.85"
    )
    assert first.endswith("elsewhere): its worst may be hidden in them")
    assert second.startswith("the worst run of soft, 0.99")
    assert "is left out of the comparison" in second


def test_the_worst_run_of_a_design_is_kept_where_another_failed():
    soft = re_evaluate(breaks, SOFT_AND_STIFF, F, samples=100).summaries[0]
    assert soft.worst <= 0.7 < soft.worst_run
    assert soft.worst_run_scenario["f"] == pytest.approx(soft.worst_run)


def test_one_failure_in_the_worst_scenario_is_told():
    designs = {"soft": {"k": 1.0, "holds": 1.0}, "stiff": {"k": 1.1, "holds": 0.99}}
    result = re_evaluate(breaks, designs, F, samples=100)
    assert result.summaries[1].failed == 1
    assert "and fails where soft is bad" in result.warnings[0]


def test_few_failures_that_sit_anywhere_are_only_counted():
    def now_and_then(x, u):
        if x["k"] == 2.0 and 0.2 < u["f"] < 0.24:
            raise RuntimeError("licence server")
        return x["k"] * u["f"]

    result = re_evaluate(now_and_then, {"a": {"k": 1.0}, "b": {"k": 2.0}}, F, samples=100)
    assert result.left_out == 4
    assert result.warnings == ()


def test_failures_anywhere_seldom_raise_an_alarm():
    """Five designs, each with 3 % of failures drawn without regard to the values: 200 comparisons."""
    alarms = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        values = rng.random((100, 5))
        values[rng.permutation(100)[:3], 0] = np.nan
        alarms += any(
            "fails where" in t for t in failure_warnings("abcde", values, 100, None, sign=1.0, unit="1")
        )
    assert alarms <= 12  # 2.5 % of 200 is 5; twelve or more have a chance below 1 %


def test_small_is_bad_looks_for_failures_at_the_small_end():
    def weak(x, u):
        return float("nan") if u["f"] < x["from"] else u["f"]

    designs = {"a": {"from": 0.0}, "b": {"from": 0.03}}
    result = re_evaluate(weak, designs, F, samples=100, sense="min", unit="N")
    assert "and fails where a is bad" in result.warnings[0]
    assert "the worst run of a, 0.00" in result.warnings[1]
    assert " N, is left out" in result.warnings[1]
    assert re_evaluate(weak, designs, F, samples=100).warnings == ()


def test_designs_that_never_succeed_together_are_refused_in_one_sentence():
    def halves(x, u):
        if (u["f"] < 0.5) != x["low"]:
            raise RuntimeError("no equilibrium")
        return u["f"]

    words = (
        r"values together in 0 of 100 scenarios \(a in 50, b in 50\); at least 10 .* Compare fewer designs"
    )
    with pytest.raises(NotEnoughRuns, match=words):
        re_evaluate(halves, {"a": {"low": True}, "b": {"low": False}}, F, samples=100)


def test_a_given_or_nominal_scenario_that_fails_is_told_and_leaves_no_nan():
    designs = {"soft": {"k": 1.0, "holds": 1.0}, "stiff": {"k": 1.1, "holds": 0.995}}
    result = re_evaluate(
        breaks, designs, F, samples=20, nominal={"f": 1.0}, extra_scenarios=[{"f": 1.0}, {"f": 0.5}]
    )
    soft, stiff = result.summaries
    assert "stiff gave no value in 1 of the 2 scenarios that were given" in result.warnings
    assert any("stiff gave no value in the nominal scenario" in text for text in result.warnings)
    assert (stiff.nominal, stiff.price_of_robustness) == (None, None)
    assert (soft.nominal, soft.price_of_robustness) == (1.0, 0.0)
    json.dumps(result.to_dict(), allow_nan=False)


def test_a_combination_without_a_value_is_a_failure():
    result = re_evaluate(
        lambda x, u: u["f"],
        {"a": {}},
        F,
        samples=20,
        response=lambda out: out["y"] if out["y"] > 0.1 else np.nan,
    )
    assert result.summaries[0].failed == 2


def test_equal_designs_and_constant_responses_are_compared():
    result = re_evaluate(lambda x, u: 1.0, {"a": {}, "b": {}}, F, samples=10, limit=1.0, screened=10)
    a, b = result.summaries
    assert (a.mean, a.worst, a.beyond_limit[0]) == (1.0, 1.0, 0.0)
    assert a.quantiles == b.quantiles
    assert result.paired == {"b - a": (0.0, 0.0, 0.0)}
    assert result.screenings[0].selected == ()


def test_designs_are_screened_in_the_same_scenarios():
    result = re_evaluate(breaks, SOFT_AND_STIFF, F, samples=40, screened=20)
    assert [s.runs for s in result.screenings] == [20, 20]


def test_an_interval_is_open_where_the_sample_has_no_rank_for_it():
    """Of n draws the largest lies above P95 with probability 1 - 0.95^n, which reaches 97.5 % at n = 72."""
    assert quantile(np.arange(71.0), 0.95)[2] is None
    assert quantile(np.arange(72.0), 0.95)[2] == 71.0
    assert quantile(np.arange(10.0), 0.05)[1] is None
    assert quantile(np.arange(10.0), 0.5)[1:] == (1.0, 8.0)


@pytest.mark.parametrize("n", [10, 20, 60, 200])
def test_quantile_intervals_hold_the_quantile(n):
    rng = np.random.default_rng(5)
    for q in (0.05, 0.5, 0.95):
        held = 0
        for _ in range(400):
            _, low, high = quantile(rng.random(n), q)
            held += (low is None or low <= q) and (high is None or q <= high)
        assert held / 400 > 0.93  # 95 % and more by construction; 400 draws scatter by 1.1 %
