"""The linear programme of one budget by sorting, beside HiGHS."""

import numpy as np
import pytest

from workbench.engine.layout.outcome.knapsack import continuous_knapsack
from workbench.engine.layout.outcome.linear_programme import linear_programme


@pytest.mark.parametrize("seed", range(20))
def test_it_is_the_linear_programme(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 40))
    gradient = rng.standard_normal(n) * (rng.random(n) < 0.8)
    cost = rng.uniform(0.1, 2.0, n) * (rng.random(n) < 0.9)
    low = rng.uniform(-1.0, 0.0, n)
    high = low + rng.uniform(0.0, 2.0, n)
    room = float(rng.uniform(cost @ low, cost @ high)) if seed % 4 else float(cost @ high) + 1.0
    x, price = continuous_knapsack(gradient, cost, room, low, high)
    solved = linear_programme(
        gradient, at_most=(cost[None], np.array([room])), bounds=np.column_stack([low, high])
    )
    assert gradient @ x == pytest.approx(solved.value, rel=1e-7, abs=1e-7)
    assert cost @ x <= room + 1e-12
    assert ((x >= low) & (x <= high)).all()
    # the price proves it: no x in the box does better with the budget paid for
    reduced = gradient + price * cost
    bound = np.minimum(reduced * low, reduced * high).sum() - price * room
    assert gradient @ x == pytest.approx(bound, rel=1e-12, abs=1e-12)


def test_a_budget_that_cannot_be_met_is_said():
    assert continuous_knapsack(np.array([-1.0]), np.ones(1), 0.5, np.ones(1), 2.0 * np.ones(1)) is None
