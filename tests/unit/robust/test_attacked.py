"""The design of a minimax search, attacked before it is reported."""

import json

import numpy as np
import pytest

from workbench import Parameter, Space, minimax
from workbench.errors import StudyError
from workbench.robust.minimax_record import MinimaxStatus
from workbench.search.evidence.grade import Grade, fewest_runs

CHOICE = Space([Parameter("x", lower=0, upper=1)])
DANGER = Space([Parameter(f"u{i}", lower=0, upper=1) for i in range(4)])


def _bowl(x, u):
    """Worst at the corner of all ones, the less the nearer x is to 0.3."""
    return (x["x"] - 0.3) ** 2 + sum(u.values())


def _spiked(x, u):
    """The same, but ten times as bad at one corner that no slope leads to."""
    far = sum(abs(value - end) for value, end in zip(u.values(), (0, 1, 0, 0), strict=True))
    return _bowl(x, u) + (10.0 if far < 0.05 else 0.0)


def test_bounds_that_nobody_attacked_have_met_and_are_not_converged():
    found = minimax(_bowl, CHOICE, DANGER, budget=80, attack=0, tolerance=1e-2)
    assert found.status is MinimaxStatus.MET
    assert found.grade is Grade.SEARCHED
    assert found.attack is None
    assert "no attack that counts has left them standing" in found.sentence


def test_an_attack_that_finds_nothing_makes_it_converged():
    found = minimax(_bowl, CHOICE, DANGER, budget=80, attack=fewest_runs(4), tolerance=1e-2)
    assert found.status is MinimaxStatus.CONVERGED
    assert found.grade is Grade.ATTACKED
    assert found.value == pytest.approx(4.0, abs=0.01)
    assert "Attacked: 100 true runs of an adversary" in found.sentence
    assert found.evaluations <= found.budget == 180


@pytest.mark.slow
def test_what_the_attack_finds_is_the_worst_scenario():
    plain = minimax(_spiked, CHOICE, DANGER, budget=80, attack=0, tolerance=1e-2)
    found = minimax(_spiked, CHOICE, DANGER, budget=80, attack=400, tolerance=1e-2)
    assert plain.value < 5 < found.value
    assert found.value == pytest.approx(_spiked(found.design, found.scenario))
    assert dict(found.scenario) in [dict(s) for s in found.scenarios]
    assert found.value >= found.lower


@pytest.mark.slow
def test_a_design_that_an_attack_has_broken_is_exchanged_for_a_better_one():
    def f(x, u):
        # the best design but for a pocket of scenarios in which only it is bad
        base = (x["x"] - 0.3) ** 2 + 0.1 * u["u0"]
        is_pocket = x["x"] < 0.5 and u["u1"] == 1 and u["u2"] == 1 and u["u3"] == 1
        return base + (3.0 if is_pocket else 0.0)

    plain = minimax(f, CHOICE, DANGER, budget=60, attack=0, tolerance=1e-2, seed=1)
    found = minimax(f, CHOICE, DANGER, budget=60, attack=600, tolerance=1e-2, seed=1)
    assert plain.design["x"] < 0.5
    assert found.design["x"] >= 0.5
    assert found.value < 1.0
    assert found.evaluations <= 60 + 600


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_bounds_that_an_attack_has_torn_apart_are_not_said_to_have_met(seed):
    def f(x, u):
        # bad everywhere at a corner that no slope leads to: no design is better, and the bound is too low
        return (x["x"] - 0.3) ** 2 + u["u0"] + (5.0 if u["u0"] == 0 and u["u1"] == 1 else 0.0)

    plane = Space([Parameter("u0", lower=0, upper=1), Parameter("u1", lower=0, upper=1)])
    found = minimax(f, CHOICE, plane, budget=60, attack=200, tolerance=1e-2, seed=seed)
    assert found.value == pytest.approx(5.0, abs=0.1)
    assert found.predicted == pytest.approx(1.0, abs=0.1)
    assert found.status is MinimaxStatus.OPENED
    assert "had met" in found.sentence


def test_a_design_broken_in_every_round_is_said_to_be_beaten():
    def f(x, u):
        return 1.0 + (x["x"] - 0.3) ** 2 + _rising(u)

    rounds = iter(np.arange(1.0, 1e6))

    def _rising(u):
        # every corner that is met is worse than all before
        return next(rounds) * 1e-3 if set(u.values()) <= {0.0, 1.0} else 0.0

    found = minimax(f, CHOICE, DANGER, budget=60, attack=150, tolerance=1e-2)
    assert found.status is MinimaxStatus.BEATEN
    assert found.grade is Grade.SEARCHED
    assert "The Kriging knew of no worse scenario, which the attack refuted" in found.sentence
    assert "which may err" not in found.sentence


def test_by_default_no_attack_is_made_where_too_few_runs_are_left():
    found = minimax(_bowl, CHOICE, DANGER, budget=80, tolerance=1e-2)
    assert found.status is MinimaxStatus.MET
    assert found.attack is None


def test_the_document_holds_grade_and_attack():
    found = minimax(_bowl, CHOICE, DANGER, budget=80, attack=fewest_runs(4), tolerance=1e-2)
    document = json.loads(json.dumps(found.to_dict()))
    assert document["grade"] == "attacked"
    assert document["attack"]["runs"] == fewest_runs(4)


@pytest.mark.parametrize("attack", [-1, 2.5, True])
def test_a_useless_budget_is_refused(attack):
    with pytest.raises(StudyError, match="attack needs a whole number of runs >= 0, or None"):
        minimax(_bowl, CHOICE, DANGER, attack=attack)
