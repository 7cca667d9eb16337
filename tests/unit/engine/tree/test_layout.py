"""Layouts of members on a tree, by the same verb as in the plane."""

import numpy as np

from workbench.engine import (
    Deviation,
    Floating,
    Maximum,
    SpatialBody,
    SpatialMember,
    Spring,
    TreeSystem,
    optimise_layout,
    simulate,
)
from workbench.engine.layout.formulation.transient import Scenario, transient_problem


def test_a_layout_of_springs_holds_a_thrown_body_better_than_the_even_one():
    body = SpatialBody(
        name="body", joint=Floating(velocity=(1.0, 0.2, 0.0)), mass=5.0, inertia=(0.1, 0.1, 0.1)
    )
    ends = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
    system = TreeSystem(
        bodies=(body,), gravity=(0.0, 0.0, 0.0),
        members=tuple(
            SpatialMember(a="body", point_a=tuple(0.2 * np.array(end)), point_b=end, law=Spring(k=300.0))
            for end in ends
        ),
    )  # fmt: skip
    objective = Maximum(quantity=Deviation(bodies=("body",), weights=(1.0, 1.0, 1.0)))
    problem = transient_problem(
        [Scenario(system=system, objective=objective, t_end=0.3, steps=60)],
        start=np.full(8, 0.3),
        budgets=[(np.ones(8), 2.4)],
    )
    even = objective.value(simulate(system, np.full(8, 0.3), t_end=0.3, steps=60))
    result = optimise_layout(problem, max_evaluations=25)
    assert result.value < 0.95 * even
    assert result.density.sum() <= 0.3 * 8 + 1e-6
