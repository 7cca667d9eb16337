"""Searches by the scenarios that bind from several starts: the start that was given is one of them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from workbench.engine.layout.bound.binding_starts import ENOUGH
from workbench.engine.layout.formulation.problem import TabulatedRows, static_problem
from workbench.engine.layout.optimise import optimise_layout

HIGHER = 0.1  # of the second valley above the first
VALLEYS = 0.2, 0.7
SETTLED = 1e-3


@dataclass
class TwoValleys:
    """Histories of two nodes: two valleys along the first density, a bowl of every scenario in the others."""

    centres: np.ndarray
    fails: bool = False

    def __call__(self, x):
        if self.fails and len(self.centres) > 1 and x[0] < 0.25:
            raise ArithmeticError("the run stopped")
        a, b = x[0] - VALLEYS[0], x[0] - VALLEYS[1]
        valley = 200 * a**2 * b**2 + HIGHER * a / (VALLEYS[1] - VALLEYS[0])
        slope = 400 * a * b * (a + b) + HIGHER / (VALLEYS[1] - VALLEYS[0])
        away = x[1:] - self.centres
        values = 1.0 + valley + (away**2).sum(axis=1)
        slopes = np.column_stack([np.full(len(away), slope), 2 * away])
        return TabulatedRows(
            values=np.repeat(values, 2).reshape(-1, 2) * [1.0, 0.5],
            gradient_table=np.repeat(slopes, 2, axis=0) * np.tile([1.0, 0.5], len(away))[:, None],
            constraint_gradients=np.zeros((0, len(x))),
        )

    def of_scenarios(self, chosen):
        return TwoValleys(self.centres[list(chosen)], self.fails)


def valleys(first, fails=False):
    centres = np.random.default_rng(3).uniform(0.0, 0.3, (12, 2))
    base = static_problem(
        lambda x: (float(x @ x), 2 * x), start=np.array([first, 0.05, 0.05]), budgets=[(np.ones(3), 0.9)]
    )
    return replace(base, evaluate=TwoValleys(centres, fails))


def search(problem, evaluations=40, several=True):
    return optimise_layout(
        problem, max_evaluations=evaluations, compare=False, multi_start=several, scenarios="binding"
    )


def test_the_start_that_is_given_does_not_decide_where_the_search_ends():
    low, high = (search(valleys(first)) for first in (0.1, 0.75))
    alone = search(valleys(0.75), several=False)
    assert alone.value > low.value + 0.5 * HIGHER
    assert high.value == pytest.approx(low.value, rel=SETTLED)
    assert "several starts" in high.strategy
    assert "several starts" not in alone.strategy


def test_the_ends_of_all_searches_are_told_and_the_best_is_the_result():
    found = search(valleys(0.75))
    assert len(found.ends) >= 4
    assert found.value == min(found.ends) == min(entry.value for entry in found.history)
    assert found.ends[0] > found.value + 0.5 * HIGHER
    assert any(f"that from the start given to {found.ends[0]:.6g}" in said for said in found.verdicts)
    assert {0, 1, 2, 3} <= {entry.start for entry in found.history}
    assert found.evaluations <= 41


def test_few_evaluations_are_left_to_the_start_that_is_given():
    assert "several starts" not in search(valleys(0.75), ENOUGH - 1).strategy
    assert "several starts" in search(valleys(0.75), ENOUGH).strategy


def test_a_start_that_cannot_be_run_in_all_scenarios_is_passed_over():
    found = search(valleys(0.75, fails=True))
    assert np.isfinite(found.value)
    assert sum(not np.isfinite(entry.value) for entry in found.history) >= 3
    assert found.density[0] >= 0.25
    assert found.value == min(entry.value for entry in found.history)


def test_the_same_problem_has_the_same_layout_every_time():
    one, two = search(valleys(0.75), 15), search(valleys(0.75), 15)
    np.testing.assert_array_equal(one.density, two.density)
