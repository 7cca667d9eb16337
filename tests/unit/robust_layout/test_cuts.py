"""Which cases join the next optimisation: the worst first, then the worst of those far from it."""

import pytest

from workbench import Parameter, Space
from workbench.models.evaluator import Outcome
from workbench.robust_layout.cuts import FAR, spread_out_worst

SPACE = Space(
    (Parameter("u", lower=0.0, upper=1.0), Parameter("hands", kind="categorical", levels=("off", "on")))
)


def outcome(u, hands, value, status="ok"):
    return Outcome(parameters={"u": u, "hands": hands}, status=status, outputs={"y": value} if value else {})


def chosen(outcomes, number=6):
    found = spread_out_worst(SPACE, outcomes, response="y", number=number)
    return [(o.parameters["u"], o.parameters["hands"], value) for value, o in found]


def test_neighbours_of_a_worse_case_are_left_out():
    runs = [outcome(0.0, "on", 1.0), outcome(0.9, "on", 3.0), outcome(0.9 - FAR / 2, "on", 2.9)]
    assert chosen(runs) == [(0.9, "on", 3.0), (0.0, "on", 1.0)]


def test_cases_with_other_words_are_never_neighbours():
    runs = [outcome(0.9, "on", 3.0), outcome(0.9, "off", 2.0)]
    assert chosen(runs) == [(0.9, "on", 3.0), (0.9, "off", 2.0)]


def test_failed_runs_are_left_out_and_the_number_is_kept():
    runs = [outcome(0.1 * k, "on", float(k)) for k in range(1, 11)] + [outcome(0.5, "off", None, "failed")]
    assert chosen(runs, number=2) == [(1.0, "on", 10.0), (pytest.approx(0.6), "on", 6.0)]
    assert chosen([outcome(0.5, "off", None, "failed")]) == []


def test_a_space_of_words_alone_keeps_each_once():
    words = Space((Parameter("hands", kind="categorical", levels=("off", "on")),))
    runs = [
        Outcome(parameters={"hands": h}, status="ok", outputs={"y": v})
        for h, v in [("on", 1.0), ("off", 2.0)]
    ]
    found = spread_out_worst(words, runs, response="y", number=6)
    assert [value for value, _ in found] == [2.0, 1.0]
