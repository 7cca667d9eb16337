"""Trees over unequal steps: order 2 however they change, and gradients that are exact for the run."""

import numpy as np
import pytest

from tests.laws.engine.tree.test_gradients import Mixed, mixed
from tests.sample_trees import random_tree
from workbench.engine import GeneralisedAlpha, RungeKutta8, gradient, simulate
from workbench.engine.tree.compiled import tree_compiled

pytestmark = pytest.mark.slow

ORDER = 0.1
QUOTIENT = 1e-7


def in_turn(n, pattern, t_end):
    return t_end * np.append(0.0, np.cumsum(np.resize(pattern, n))) / np.resize(pattern, n).sum()


def test_order_2_on_steps_that_change_all_the_time():
    system = random_tree(np.random.default_rng(11), count=4, elements=False)
    density = np.full(len(system.members), 0.6)
    true = simulate(system, density, 0.2, 400, scheme=RungeKutta8())
    errors = []
    for n in (100, 200, 400):
        run = simulate(system, density, times=in_turn(n, (1, 3), 0.2))
        errors.append(
            [np.abs(getattr(run, x)[-1] - getattr(true, x)[-1]).max() for x in ("position", "velocity")]
        )
    order = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert np.abs(order - 2.0).max() < ORDER


@pytest.mark.parametrize("scheme", [GeneralisedAlpha(tolerance=1e-15), RungeKutta8()])
@pytest.mark.parametrize("kept", [True, False])
def test_gradients_are_exact_over_random_steps_with_every_element(scheme, kept, monkeypatch):
    if not kept:
        monkeypatch.setattr("workbench.engine.tree.runs.MEMORY", 0.0)
    rng = np.random.default_rng(7)
    system = random_tree(rng, count=4)
    density = rng.uniform(0.3, 1.0, len(system.members))
    times = in_turn(16, rng.uniform(0.3, 2.0, 16), 0.03)
    objective: Mixed = mixed(rng, tree_compiled(system))
    run = simulate(system, density, times=times, scheme=scheme)
    found = gradient(system, density, run, objective)
    along = rng.normal(size=len(density))
    low, below, above, high = (
        objective.value(simulate(system, density + k * 1e-3 * along, times=times, scheme=scheme))
        for k in (-2, -1, 1, 2)
    )
    slope = (8 * (above - below) - (high - low)) / 12e-3
    assert abs(found @ along - slope) < QUOTIENT * np.abs(found).max() * np.abs(along).sum()
