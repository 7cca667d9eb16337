"""Contractions of adjoints with members: what takes one row of springs, and what takes several rows."""

import numpy as np
import pytest

from studies import two_body
from workbench.engine import Maximum, StoredEnergy, Terminal, gradient, gradients, simulate


@pytest.mark.parametrize("objective", [Terminal, Maximum])
@pytest.mark.parametrize("steps", [1, 2, 7, 8])
def test_springs_two_nodes_at_a_time_are_those_one_by_one(steps, objective):
    """Odd and even numbers of nodes; two equal objectives share a sweep that goes node by node."""
    p = two_body.problem("C")
    goal = objective(quantity=StoredEnergy())
    run = simulate(p.system, p.density, p.t_end, steps)
    alone = gradient(p.system, p.density, run, goal)
    together = gradients(p.system, p.density, run, (goal, goal))
    scale = np.abs(alone).max()
    assert scale > 0.0
    for row in together:
        np.testing.assert_allclose(row, alone, rtol=0.0, atol=1e-13 * scale)
