"""Starts of a fixed min-max problem, and what is told of their ends."""

import numpy as np
import pytest

from studies.binding_scenarios import WAYS, Searched, drawn_problem, searched, starts_of, told
from workbench.engine.layout.bound.binding import is_by_scenario


def test_problems_are_those_of_their_seed_and_large_enough_to_be_searched_by_binding_cases():
    model, cases = drawn_problem(516, steps=100)
    again = drawn_problem(516, steps=100)
    assert (model.limits, cases) == (again[0].limits, again[1])
    assert cases != drawn_problem(517, steps=100)[1]
    problem = model.problem(cases)
    assert is_by_scenario(problem, problem.evaluate(problem.start))


@pytest.mark.slow
def test_searches_are_judged_by_all_cases_whichever_way_they_are_made():
    model, cases = drawn_problem(516, steps=100)
    cases = cases[:11]
    starts = starts_of(model, cases, seed=516)
    assert list(starts) == ["nominal", "its worst", "middle", "uniform", "random"]
    np.testing.assert_array_equal(starts["middle"], 0.5 * (starts["nominal"] + starts["its worst"]))
    before = model.as_response(model.problem(cases).evaluate(starts["uniform"]).values.max())
    for way in WAYS:
        found = searched(model, cases, starts["uniform"], way=way, evaluations=3)
        assert 0.0 < found.value < before
        assert found.error > 0.0


def test_what_is_told_counts_from_the_best_of_all_searches_of_a_problem():
    def row(*values):
        return {str(k): Searched(value=v, error=0.01 * k, spent=2.0) for k, v in enumerate(values)}

    made = {
        1: {"all": row(1.1, 1.0), "binding": row(1.0, 1.01)},
        2: {"all": row(2.0, 2.6), "binding": row(2.0, 2.02)},
    }
    everywhere, few = told(made).splitlines()
    assert "all starts within 2 %: 0 of 2" in everywhere
    assert "10.0 % in the mean, 30.0 % at most; 2.0 CPU s" in everywhere
    assert "all starts within 2 %: 2 of 2" in few
    assert "at most 2 %: 2; above the best known: 0.5 % in the mean, 1.0 % at most" in few
