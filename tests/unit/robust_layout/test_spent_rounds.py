"""Rounds of a robust loop end where the last ones gained nothing: what is left is attacked as it is."""

from dataclasses import replace

import pytest

from tests.sample_layout import changed, run
from workbench.robust_layout.loop import _Loop
from workbench.robust_layout.model import layout_name
from workbench.robust_layout.oracle import Found
from workbench.robust_layout.record import LoopSettings, Round, is_as_good, loop_status, rounds_are_spent

SETTINGS = LoopSettings(rounds=12, tolerance=0.02)


def rounds_of(count, *, bound=1.0):
    """Rounds that each looked at a layout of their own."""
    return [
        Round(
            number=k, cases=3, layout=f"round {k}", bound=bound, worst=1.03, case={}, gap=0.03, runs=9,
            attacked=True, optimiser="",
        )
        for k in range(1, count + 1)
    ]  # fmt: skip


def is_spent(worst, *, bound=1.0):
    """Whether rounds whose layouts are worth `worst` over all cases are spent."""
    values = {f"round {k}": value for k, value in enumerate(worst, start=1)}
    return rounds_are_spent(rounds_of(len(worst), bound=bound), values.__getitem__, SETTINGS)


def test_three_rounds_that_gain_less_than_half_a_tolerance_are_the_last():
    assert is_spent([1.5, 1.04, 1.036, 1.05, 1.035])
    assert not is_spent([1.5, 1.04, 1.036, 1.05])  # the second is one of the last three
    assert not is_spent([1.5, 1.04, 1.036, 1.05, 1.02])  # 1.6 % lower
    assert not is_spent([1.04, 1.04, 1.04])


def test_where_the_best_layout_is_far_above_what_the_last_was_made_for_rounds_go_on():
    assert not is_spent([1.3, 1.3, 1.4, 1.3, 1.3], bound=1.1)
    assert is_spent([1.3, 1.3, 1.4, 1.3, 1.3], bound=1.25)
    assert is_spent([-1.0, -1.0, -1.0, -1.0], bound=-1.05)  # responses below zero


def test_no_more_rounds_are_made_than_were_asked_for():
    assert is_spent([2.0 / k for k in range(1, 13)])


def test_a_layout_as_good_as_what_the_last_round_was_made_for_needs_no_other():
    rounds = rounds_of(2)
    assert is_as_good(1.009, rounds, SETTINGS)
    assert not is_as_good(1.011, rounds, SETTINGS)
    assert not is_as_good(0.5, [], SETTINGS)
    below = rounds_of(1, bound=-1.0)
    assert is_as_good(-0.991, below, SETTINGS)
    assert not is_as_good(-0.989, below, SETTINGS)


def test_rounds_without_a_layout_do_not_raise_what_others_are_held_to():
    rounds = rounds_of(2)
    rounds.append(replace(rounds[-1], number=3, cases=0, bound=1.009))
    assert is_as_good(1.009, rounds, SETTINGS)
    assert not is_as_good(1.018, rounds, SETTINGS)


def test_what_is_said_of_an_open_loop_does_not_call_rounds_spent_that_are_left():
    found = Found(value=3.3, case={}, runs=60, status="", attack={"arrived": 2, "climbs": 5})
    assert loop_status(found, 3.0, closed=False, idle=True).startswith(
        "The last rounds gained nothing, and the last attack found 10 % above the bound"
    )
    assert loop_status(found, None, closed=False, idle=True).startswith(
        "The last rounds gained nothing, and attacks broke the layouts that were better before."
    )


@pytest.mark.slow
def test_a_loop_whose_layouts_all_break_by_little_ends_before_its_rounds(tmp_path, monkeypatch):
    """What a look or an attack finds is 4 % worse than all that was known, but in the last, whole attack."""
    keep, attack, whole = _Loop.keep, _Loop.attack, []

    def asked(loop, name, turn, *, to_the_end=False):
        whole.append(to_the_end)
        return attack(loop, name, turn, to_the_end=to_the_end)

    def worse(loop, name, found):
        if whole and whole[-1]:
            return keep(loop, name, found)
        case, value = loop.judged.cases[-1], 1.04 * loop.judged.worst(name)
        loop.judged._answers[layout_name(loop.judged.layouts[name])][repr(sorted(case.items()))] = value
        return keep(loop, name, replace(found, value=value, case=case))

    monkeypatch.setattr(_Loop, "attack", asked)
    monkeypatch.setattr(_Loop, "keep", worse)
    found, _ = run(tmp_path, changed("rounds = 5", "rounds = 30"))
    assert 4 <= len(found["rounds"]) < 30
    assert whole[-1]
    assert found["status"].startswith("An earlier bound was broken by ")
