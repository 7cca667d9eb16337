"""Attacks on a layout that go on from the worst they found, against the first limit."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_layout import TwoMembers, value
from tests.unit.robust_layout.test_loop import run
from workbench.models.evaluator import FunctionEvaluator
from workbench.robust_layout import oracle
from workbench.robust_layout.oracle import LayoutOracle, is_settled
from workbench.space.box import Space
from workbench.space.parameter import Parameter

SPACE = Space((Parameter("u", lower=-1, upper=1), Parameter("v", lower=0, upper=1)))
LAYOUT = np.array([0.86, 0.14])
CASES = [{"u": 0.0, "v": 0.0}, {"u": 0.9, "v": 0.0}]
REAL = oracle.attack


def looked_for(folder, *, limit=4.3, space=SPACE, to_the_end=False, **options):
    model = TwoMembers()
    where = LayoutOracle(
        model=model, space=space, folder=folder, identity="two", budget=60, corners=4, seed=3,
        evaluator=lambda density: FunctionEvaluator(lambda **u: model.responses(density, u)), **options,
    )  # fmt: skip
    return where.attack(LAYOUT, CASES, limit=limit, turn=1, to_the_end=to_the_end)


@pytest.fixture
def attacks(monkeypatch):
    """The attacks asked for; what each finds is changed by `found[number]`."""
    asked, found = [], {}

    def attack(*arguments, **options):
        asked.append(options)
        made = REAL(*arguments, **options)
        return replace(made, **found.get(len(asked), found.get("all", {})))

    monkeypatch.setattr(oracle, "attack", attack)
    return asked, found


def test_one_attack_at_whose_worst_climbs_arrive_is_enough(tmp_path, attacks):
    asked, _ = attacks
    found = looked_for(tmp_path)
    assert [one["budget"] for one in asked] == [24, 36]  # corners and climbs, then the rest
    assert found.attack["arrived"] >= 2
    assert found.runs == 60
    assert found.attack["share"]["draws"] >= 15  # a quarter of the budget is drawn evenly
    assert asked[0]["known"] == [(CASES[1], pytest.approx(value(LAYOUT, 0.9, 0.0)))]


def test_a_layout_that_breaks_costs_the_first_part_of_an_attack(tmp_path, attacks):
    asked, _ = attacks
    found = looked_for(tmp_path, limit=3.0)
    assert len(asked) == 1
    assert found.runs == 24
    assert found.value > 3.0
    assert "independent" not in found.status  # no even draws stand behind it


def test_an_attack_to_the_end_spends_the_whole_budget_on_a_layout_that_breaks(tmp_path, attacks):
    asked, _ = attacks
    early, late = looked_for(tmp_path, limit=3.0), looked_for(tmp_path, limit=3.0, to_the_end=True)
    assert [one["budget"] for one in asked] == [24, 24, 36]  # and no attack goes on after that
    assert early.runs < late.runs == 60
    assert early.value <= late.value
    assert late.attack["share"]["draws"] >= 15


def test_a_space_within_the_budget_is_run_whole_at_once(tmp_path, attacks):
    asked, _ = attacks
    whole = Space((Parameter("u", lower=-1, upper=1, step=0.1), Parameter("v", lower=0, upper=1, step=1.0)))
    found = looked_for(tmp_path, space=whole)
    assert len(asked) == 1
    assert found.attack["exhaustive"]
    assert found.runs == 42


def test_an_attack_goes_on_from_the_worst_it_found_against_the_first_limit(tmp_path, attacks):
    asked, changes = attacks
    changes["all"] = {"arrived": 0}
    found = looked_for(tmp_path)
    assert [one["budget"] for one in asked] == [24, 36, 60, 60, 60]
    assert [one["value"] for one in asked] == [4.3] * 5
    assert len({one["seed"] for one in asked}) == 5
    worst = [one["known"][0][1] for one in asked]
    assert worst[0] < worst[1] == pytest.approx(max(value(LAYOUT, u, 1.0) for u in (-1, 1)), rel=1e-3)
    assert found.runs == 240
    assert not is_settled(found.attack)


def test_what_breaks_the_limit_later_breaks_the_layout(tmp_path, attacks):
    asked, changes = attacks
    changes[1] = changes[2] = {"arrived": 0}
    changes[3] = {"largest": 4.4}
    found = looked_for(tmp_path)
    assert len(asked) == 3
    assert found.attack["largest"] == 4.4
    assert found.attack["excess"] == pytest.approx(0.1)


def test_climbs_that_arrived_below_a_worse_case_do_not_count(tmp_path, attacks):
    asked, changes = attacks
    changes[1] = {"arrived": 1}
    changes[2] = {"arrived": 1, "largest": 4.29}  # below the limit, and 3 % above the first worst
    changes[3] = {"arrived": 1, "largest": 4.29}
    found = looked_for(tmp_path)
    assert len(asked) == 3
    assert found.attack["arrived"] == 2


def test_a_short_attack_does_not_go_on(tmp_path, attacks, monkeypatch):
    asked, changes = attacks
    changes["all"] = {"arrived": 0}
    monkeypatch.setattr(oracle, "fewest_runs", lambda dimension: 61)
    looked_for(tmp_path)
    assert [one["budget"] for one in asked] == [24, 36]


@pytest.mark.slow
def test_a_loop_in_which_no_climbs_arrive_is_not_closed_however_often_it_is_attacked(tmp_path, attacks):
    _, changes = attacks
    changes["all"] = {"arrived": 0, "is_exhaustive": False}
    found, _ = run(tmp_path)
    assert not found["closed"]
    assert found["grade"] == "searched"
    assert found["may_exceed"] >= 0.02
    assert found["attack"]["runs"] == 4 * 1300
    assert found["attack"]["arrived"] == 0
    assert "climbs from elsewhere arrived at the worst of them" in found["status"]
    assert found["status"].startswith("5200 true runs of an adversary found nothing more than")
