"""Which cases join the next optimisation: the worst first, then the worst of those far from it."""

from types import SimpleNamespace

import pytest

from tests.sample_layout import STUDY
from workbench import Parameter, Space
from workbench.errors import StudyError
from workbench.models.evaluator import Outcome
from workbench.robust_layout.cuts import FAR, spread_out_worst
from workbench.robust_layout.loop import _Loop
from workbench.robust_layout.oracle import Found
from workbench.robust_layout.record import LoopSettings
from workbench.study.loading import parse_study

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


@pytest.mark.parametrize(("joining", "joined"), [(1, [0.9]), (3, [0.9, 0.1, 0.2]), (6, [0.9, 0.1, 0.2, 0.3])])
def test_as_many_cases_that_break_a_layout_join_as_the_study_says(joining, joined):
    others = [{"case": {"u": 0.1 * k}, "value": 3.0 - k} for k in range(1, 4)]
    found = Found(
        value=4.0, case={"u": 0.9}, runs=9, status="", others=[*others, {"case": {}, "value": -1.0}]
    )
    cases = []
    loop = SimpleNamespace(
        settings=LoopSettings(joining=joining), limit=lambda bound: bound + 0.02,
        judged=SimpleNamespace(cases=cases, join=cases.extend),
    )  # fmt: skip
    _Loop.join(loop, found, -0.5)
    assert [case["u"] for case in cases] == pytest.approx(joined)


@pytest.mark.parametrize("joining", [0, 13])
def test_no_case_or_more_than_an_attack_tells_cannot_join(joining):
    text = STUDY.replace("[robust_layout]\n", f"[robust_layout]\njoining = {joining}\n")
    with pytest.raises(StudyError, match=rf"robust_layout.*joining.*{joining}"):
        parse_study(text)
