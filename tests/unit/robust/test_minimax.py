"""Minimax problems with known answers, bounds, resumption and bad input."""

import json
import re

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import FunctionEvaluator
from workbench.robust.minimax import MinimaxStatus, minimax
from workbench.space.box import Parameter, Space


def box(prefix, count, lower, upper):
    return Space([Parameter(f"{prefix}{i + 1}", lower=lower, upper=upper) for i in range(count)])


def saddle(x, u):
    return (x["x1"] - 5) ** 2 - (u["u1"] - 5) ** 2


def coupled(x, u):
    """Rustem and Howe 2002, problem 1: -1.6833 at x = (-0.4833, -0.3167)."""
    x1, x2, u1, u2 = x["x1"], x["x2"], u["u1"], u["u2"]
    return 5 * (x1**2 + x2**2) - (u1**2 + u2**2) + x1 * (-u1 + u2 + 5) + x2 * (u1 - u2 + 3)


LINE = (box("x", 1, 0.0, 10.0), box("u", 1, 0.0, 10.0))
PLANE = (box("x", 2, -5.0, 5.0), box("u", 2, -5.0, 5.0))


def test_a_saddle_is_found_with_bounds_every_cycle():
    cycles = []
    result = minimax(saddle, *LINE, budget=100, seed=0, progress=cycles.append)
    assert result.value == pytest.approx(0.0, abs=0.01)
    assert result.design["x1"] == pytest.approx(5.0, abs=0.05)
    assert result.status is MinimaxStatus.CONVERGED
    assert tuple(cycles) == result.cycles
    # the attack on the returned design may raise its worst; the cycles did not know of that
    claimed = result.value if result.attack.raised_from is None else result.attack.raised_from
    assert abs(claimed - result.value) < 1e-6
    assert all(c.best >= claimed - 1e-12 for c in cycles)
    assert result.gap >= 0.0


@pytest.mark.parametrize("seed", [0, 1])
def test_the_coupled_problem_within_one_percent(seed):
    result = minimax(coupled, *PLANE, budget=300, seed=seed)
    assert result.value == pytest.approx(-1.6833, abs=0.0168)
    assert result.design["x1"] == pytest.approx(-0.4833, abs=0.02)
    assert result.evaluations <= 300


def test_the_value_is_a_true_run_at_the_returned_design():
    result = minimax(coupled, *PLANE, budget=80, seed=2)
    assert coupled(result.design, result.scenario) == pytest.approx(result.value, rel=1e-12)


def test_a_lower_bound_says_for_which_designs_it_holds():
    part = r"no design in the part that was looked at last, (\S+) % of every range, gets below"
    cut = minimax(coupled, *PLANE, budget=40, seed=2)
    assert cut.status is MinimaxStatus.BUDGET
    assert float(re.search(part, cut.sentence)[1]) == pytest.approx(100 * cut.cycles[-1].box, rel=0.05)
    low, high = cut.part["x1"]
    assert high - low == pytest.approx(10 * cut.cycles[-1].box)
    met = minimax(saddle, *LINE, budget=100, seed=0)
    assert met.cycles[-1].box == 1.0
    assert "and no design gets below" in met.sentence
    assert met.part == {"x1": (0.0, 10.0)}


def test_a_bound_leaves_the_kriging_room_to_err():
    """With 18 runs it knows too little of a wave to hold its prediction for a bound."""

    def waves(x, u):
        return 1.5 * np.cos(2.5 * x["x1"]) + 0.1 * (x["x1"] - 5) ** 2 + np.sin(u["u1"])

    found = minimax(waves, *LINE, budget=18, seed=2, attack=0)
    assert found.lower < found.predicted - 1e-2
    assert found.predicted <= found.value
    assert found.gap == found.value - found.lower
    said = f"gets below {found.lower:.6g}, where it is given 2 standard deviations to err"
    assert said in found.sentence
    assert f"it predicts {found.predicted:.6g} for the best" in found.sentence
    assert found.to_dict()["predicted"] == found.predicted


def test_a_worst_case_at_a_vertex_of_the_uncertainty():
    def tilted(x, u):
        return (x["x1"] - u["u1"]) ** 2

    result = minimax(tilted, *LINE, budget=90, seed=0)
    assert result.design["x1"] == pytest.approx(5.0, abs=0.1)  # the middle: 5 from both ends
    assert result.value == pytest.approx(25.0, rel=0.02)


def test_discrete_designs_stay_on_their_levels():
    space = Space([Parameter("x1", kind="discrete", levels=(1.0, 4.0, 6.5, 9.0))])
    result = minimax(saddle, space, LINE[1], budget=60, seed=0)
    assert result.design["x1"] == 4.0
    assert result.value == pytest.approx(1.0, abs=0.02)


def test_an_interrupted_search_repeats_no_run():
    calls = []

    def joint(x1, u1):
        calls.append((x1, u1))
        if len(calls) == 12:
            raise KeyboardInterrupt
        return saddle({"x1": x1}, {"u1": u1})

    evaluate = FunctionEvaluator(joint)
    with pytest.raises(KeyboardInterrupt):
        minimax(saddle, *LINE, budget=40, seed=1, evaluator=evaluate)
    resumed = minimax(saddle, *LINE, budget=40, seed=1, evaluator=evaluate)
    assert resumed == minimax(saddle, *LINE, budget=40, seed=1)
    assert len(calls) == len(set(calls)) + 1


def test_failed_runs_are_counted():
    def brittle(x, u):
        return float("nan") if x["x1"] > 8 else saddle(x, u)

    result = minimax(brittle, *LINE, budget=100, seed=0)
    assert result.failures >= 1
    assert result.value == pytest.approx(0.0, abs=0.05)


def test_bad_input_is_named():
    with pytest.raises(StudyError, match=r"design and uncertainty share the names \['x1'\]"):
        minimax(saddle, LINE[0], LINE[0])
    with pytest.raises(StudyError, match="budget=5 is below 3 runs per coordinate, 6 for 1 design and 1"):
        minimax(saddle, *LINE, budget=5)
    with pytest.raises(NotEnoughRuns, match="0 of 16 runs of the start design gave a value"):
        minimax(lambda x, u: float("nan"), *LINE, budget=60)


def test_the_scenarios_of_one_search_begin_the_next():
    first = minimax(saddle, *LINE, budget=60, seed=0)
    document = json.loads(json.dumps(first.to_dict()))
    assert document["gap"] == first.gap
    assert len(document["cycles"]) == len(first.cycles)
    again = minimax(saddle, *LINE, budget=60, seed=1, scenarios=document["scenarios"])
    kept = again.scenarios[: len(first.scenarios)]
    assert [row["u1"] for row in kept] == pytest.approx([row["u1"] for row in first.scenarios])
    assert again.value == pytest.approx(0.0, abs=0.01)


def test_a_scenario_outside_the_uncertainty_is_named():
    with pytest.raises(
        StudyError, match="scenario 2 of 2 is not in the uncertainty: parameter 'u1' lies between 0 and 10"
    ):
        minimax(saddle, *LINE, budget=60, scenarios=[{"u1": 1.0}, {"u1": 11.0}])
