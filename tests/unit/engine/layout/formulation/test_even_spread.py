"""The trivial layout spends every budget, whatever the others allow."""

import numpy as np
import pytest

from workbench.engine.layout.formulation.even_spread import even_spread
from workbench.engine.layout.formulation.problem import static_problem
from workbench.engine.layout.optimise import optimise_layout


def problem(budgets, *, members=4, **bounds):
    def value(a):
        return float(((a - 2) ** 2).sum()), 2 * (a - 2)

    return static_problem(value, start=np.full(members, 0.01), budgets=budgets, **bounds)


LEFT, RIGHT = np.array([1.0, 1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0, 1.0])
FIRST_THREE, LAST_TWO = np.array([1.0, 1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0, 1.0])


@pytest.mark.parametrize(
    ("budgets", "expected"),
    [
        ([(np.ones(4), 1.0)], [0.25, 0.25, 0.25, 0.25]),
        ([(LEFT, 1.5), (RIGHT, 0.5)], [0.75, 0.75, 0.25, 0.25]),
        ([(LEFT, 9.0), (RIGHT, 0.5)], [1.0, 1.0, 0.25, 0.25]),  # the bounds take no more
        ([(FIRST_THREE, 0.6), (LAST_TWO, 1.0)], [0.2, 0.2, 0.2, 0.8]),  # the third stops with the first three
        ([(FIRST_THREE, 1.5), (LAST_TWO, 0.2)], [0.7, 0.7, 0.1, 0.1]),
        ([(LEFT, 0.5)], [0.25, 0.25, 0.25, 0.25]),  # in no budget: no more than the others
        ([(LEFT, 0.0), (RIGHT, 0.5)], [0.0, 0.0, 0.25, 0.25]),
        ([], [1.0, 1.0, 1.0, 1.0]),
    ],
)
def test_every_budget_is_spent_as_far_as_bounds_and_the_others_allow(budgets, expected):
    np.testing.assert_allclose(even_spread(problem(budgets)), expected, rtol=1e-12)


def test_shares_are_of_the_room_between_the_bounds():
    bounds = {"lower": np.array([0.1, 0.1, 0.2, 0.3]), "upper": np.array([0.5, 0.1, 0.7, 1.0])}
    made = problem([(LEFT, 0.4), (2.0 * RIGHT, 1.6)], **bounds)
    np.testing.assert_allclose(even_spread(made), [0.3, 0.1, 0.325, 0.475], rtol=1e-12)
    np.testing.assert_allclose(made.usage(even_spread(made)), 1.0, rtol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_no_member_can_have_more_without_one_that_has_no_more_having_less(seed):
    rng = np.random.default_rng(seed)
    costs = rng.random((3, 7)) * (rng.random((3, 7)) < 0.6)
    made = problem([(row, 0.3 * row.sum() * rng.random()) for row in costs], members=7)
    found = even_spread(made)
    assert made.excess(found) <= 1e-12
    spent = made.usage(found) > 1 - 1e-9
    for i in np.flatnonzero((costs > 0).any(axis=0)):
        holding = [j for j in range(3) if costs[j, i] > 0 and spent[j]]
        assert found[i] == 1.0 or any(found[costs[j] > 0].max() <= found[i] + 1e-9 for j in holding)


def test_the_optimiser_is_compared_with_all_of_every_budget():
    made = optimise_layout(problem([(LEFT, 1.5), (RIGHT, 0.5)]), max_evaluations=20)
    assert made.baselines["uniform"] == pytest.approx(2 * 1.25**2 + 2 * 1.75**2)
