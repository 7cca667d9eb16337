"""What stands behind a worst case, by its gap and its attack."""

from dataclasses import replace

import pytest

from workbench import Parameter, Space
from workbench.models.evaluator import FunctionEvaluator
from workbench.search.evidence.attack.adversary import attack
from workbench.search.evidence.gap import Gap
from workbench.search.evidence.grade import BEYOND, Grade, fewest_runs, grade_of

OPEN = Gap(upper=2.0, width=1.0, coverage=0.95, kind="model-based")
BOX = Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(3)])


def _attack(function=lambda **x: sum(x.values()), *, value=3.0, budget=75):
    assert fewest_runs(BOX.dimension) == 75
    return attack(FunctionEvaluator(function), BOX, value=value, budget=budget, seed=0)


def test_without_an_attack_the_search_alone_has_looked():
    assert grade_of(OPEN, None) is Grade.SEARCHED


def test_certificates_and_whole_enumerations_prove():
    for kind in ("enumerated", "Lipschitz", "enclosure"):
        assert grade_of(replace(OPEN, kind=kind), None) is Grade.PROVED
    assert grade_of(replace(OPEN, kind="enumerated", failed=2), None) is Grade.SEARCHED


def test_an_attack_counts_when_it_found_nothing():
    assert grade_of(OPEN, _attack()) is Grade.ATTACKED


def test_an_attack_of_few_runs_does_not_count():
    assert grade_of(OPEN, _attack(budget=fewest_runs(3) - 1)) is Grade.SEARCHED


@pytest.mark.parametrize(("runs", "grade"), [(1192, Grade.SEARCHED), (1196, Grade.ATTACKED)])
def test_an_attack_of_a_worst_case_counts_where_less_than_a_hundredth_may_lie_beyond(runs, grade):
    made = _attack(budget=runs)
    assert (made.share.high <= BEYOND) == (grade is Grade.ATTACKED)
    assert grade_of(OPEN, made) is Grade.ATTACKED
    assert grade_of(OPEN, made, beyond=BEYOND) is grade


def test_an_attack_that_gained_in_its_second_half_does_not_count():
    made = _attack()
    assert grade_of(OPEN, replace(made, since=made.runs // 2 - 1)) is Grade.SEARCHED


def test_an_attack_whose_climbs_end_elsewhere_does_not_count():
    made = _attack()
    assert made.arrived >= 2
    assert grade_of(OPEN, replace(made, arrived=1)) is Grade.SEARCHED


@pytest.mark.parametrize(("fails", "grade"), [(False, Grade.PROVED), (True, Grade.SEARCHED)])
def test_an_attack_that_ran_every_case_proves_unless_one_failed(fails, grade):
    space = Space([Parameter("n", kind="integer", lower=0, upper=9)])

    def f(n):
        if fails and n == 9:
            raise ArithmeticError("no convergence")
        return float(n)

    made = attack(FunctionEvaluator(f), space, value=9.0, budget=10, seed=0)
    assert grade_of(OPEN, made) is grade
