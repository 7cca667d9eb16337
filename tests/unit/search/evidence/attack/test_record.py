"""Attacks on one claim, one after the other, as one record."""

from dataclasses import replace

import pytest

from workbench import Parameter, Space
from workbench.models.evaluator import FunctionEvaluator
from workbench.search.evidence.attack.adversary import attack
from workbench.search.evidence.attack.share import counted_share

SPACE = Space([Parameter("x", lower=0, upper=1), Parameter("y", lower=0, upper=1)])


def _made(value, *, seed, sense="max", budget=60):
    def f(x, y):
        return 1.0 - (x - 0.4) ** 2 - (y - 0.6) ** 2

    signed = f if sense == "max" else lambda x, y: -f(x, y)
    return attack(
        FunctionEvaluator(signed), SPACE, value=value, budget=budget, seed=seed, sense=sense,
        claimed={"x": 0.4, "y": 0.6},
    )  # fmt: skip


@pytest.mark.parametrize("sense", ["max", "min"])
def test_two_silent_attacks_count_together(sense):
    value = 1.0 if sense == "max" else -1.0
    first, second = (_made(value, seed=seed, sense=sense) for seed in (0, 1))
    both = first.and_then(second)
    assert both.runs == first.runs + second.runs == both.since
    assert both.budget == first.budget + second.budget
    assert both.arrived == first.arrived + second.arrived
    assert both.climbs == first.climbs + second.climbs
    assert both.share == counted_share(0, len(first.independent) + len(second.independent))
    assert both.failing == counted_share(0, both.share.draws)
    sign = 1.0 if sense == "max" else -1.0
    assert sign * both.largest == max(sign * first.largest, sign * second.largest)
    assert not both.is_beaten


def test_what_the_later_one_found_makes_the_arrivals_of_the_first_void():
    first, second = _made(0.9, seed=0), _made(0.9, seed=1)
    assert second.since < second.runs
    both = first.and_then(second)
    assert both.since == second.since
    assert both.arrived == second.arrived
    assert both.largest == max(first.largest, second.largest)
    assert both.share.hits == sum(v > 0.9 for v in both.independent) > 0


def test_a_value_that_was_raised_twice_was_raised_from_the_first():
    first = _made(0.9, seed=0)
    raised = first.raised_to(first.largest)
    assert raised.raised_from == 0.9
    assert raised.raised_to(raised.value).raised_from == 0.9
    later = replace(_made(first.largest, seed=1), raised_from=None)
    assert raised.and_then(later).raised_from == 0.9
    assert "raised the worst from 0.9" in raised.and_then(later).sentence


def test_a_value_raised_by_less_than_its_digits_tell_is_not_told_as_raised():
    """ "raised the worst from 1 in small steps, and found nothing beyond 1" tells a reader nothing."""
    raised = replace(_made(1.0, seed=0), raised_from=1.0 - 1e-9)
    assert "raised" not in raised.sentence
    assert "found nothing beyond 1;" in raised.sentence


@pytest.mark.parametrize("sense", ["max", "min"])
def test_climbs_have_not_arrived_at_a_value_that_the_attack_did_not_know(sense):
    sign = 1.0 if sense == "max" else -1.0
    made = _made(sign, seed=0, sense=sense)
    assert made.arrived > 0
    assert made.raised_to(sign * 1.001).arrived == made.arrived  # a few digits more
    left = made.raised_to(sign * 1.3)
    assert left.arrived == 0
    assert "none of" in left.sentence
    assert left.share.hits == 0
