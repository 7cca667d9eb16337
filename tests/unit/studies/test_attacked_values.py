"""Attacked values stand against fresh runs of another sampler."""

import numpy as np
import pytest

from studies.attacked_values import BEATEN, CASES, Case, fresh_best, main, of_each_make, run
from workbench import Parameter, Space

SUBSET = ("borehole max", "branin min", "camel min", "friedman5 max")


def test_there_are_thirty():
    assert len(CASES) == 30


def test_every_make_is_drawn_as_often_and_anew_with_another_seed():
    cases = of_each_make(3, count=2)
    assert len(cases) == len({case.name for case, _ in cases}) == 36
    (first, seed), (again, _) = cases[0], of_each_make(4, count=1)[0]
    assert (first.name, again.name, seed) == ("jumps 0", "jumps 0", 3)
    assert [seed for _, seed in cases[18:]] == [4] * 18
    row = {name: 0.5 for name in (p.name for p in first.space.parameters)}
    assert first.function(**row) == of_each_make(3, count=1)[0][0].function(**row)


def test_the_sampler_finds_a_peak_inside_and_a_worse_level():
    space = Space(
        [
            Parameter("a", lower=0.0, upper=1.0),
            Parameter("b", lower=-2.0, upper=2.0),
            Parameter("level", kind="categorical", levels=("low", "middle", "high")),
        ]
    )

    def peak(a, b, level):
        if a > 0.9:
            raise FloatingPointError("no convergence")
        return -((a - 0.3) ** 2) - (b - 0.7) ** 2 + {"low": 0.0, "middle": 2.0, "high": 1.0}[level]

    case = Case(name="peak", function=peak, space=space)
    worst, lowest = fresh_best(case, np.array([0.1, 0.1, 0.0]), runs=600, seed=0)
    assert 1.99 < worst <= 2.0
    assert lowest < 0.0
    smallest, _ = fresh_best(
        Case(name="pit", function=lambda **x: -peak(**x), space=space, sense="min"),
        np.array([0.1, 0.1, 0.0]),
        runs=600,
        seed=0,
    )
    assert 1.99 < smallest <= 2.0  # signed: large is bad


@pytest.mark.slow
def test_attacked_values_of_a_subset_are_not_beaten():
    found = run((0,), names=SUBSET)
    graded = found["graded"].values > 0
    assert graded.sum() >= 3
    assert float(found["excess"].values[graded].max()) <= BEATEN


@pytest.mark.slow
def test_the_command_prints_a_line_per_function_and_what_was_beaten(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["attacked_values", "drawn", "2", "5", "--attack", "60"])
    main()
    *each, attacked, searched = capsys.readouterr().out.splitlines()
    assert len(each) == 2
    assert all(" searched " in line for line in each)  # 60 runs are too few for the word
    assert attacked == "attacked or proved: 0 of 0 beaten by more than 2 %"
    assert searched.endswith(" of 2 beaten by more than 2 %")
