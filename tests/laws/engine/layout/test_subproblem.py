"""What holds for every separable subproblem (no NaN, convex, matched, optimal), density and front."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.engine.layout.formulation.problem import static_problem
from workbench.engine.layout.pareto import hypervolume, pareto_filter
from workbench.engine.layout.separable.dual import kkt_residual, solve_subproblem
from workbench.engine.layout.separable.model import SeparableModel

MATCH = 1e-13  # value and gradient at the point: rounding of one evaluation
OPTIMAL = 1e-9  # residual of the optimality conditions, scaled by reach

numbers = st.integers(0, 2**32 - 1)


def model_of(seed, n, m):
    """Gradients of both signs and many sizes, zero columns, members in no or several budgets."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(0.01, 0.99, n)
    gradients = rng.normal(size=(m + 1, n)) * 10.0 ** rng.uniform(-4, 4, size=(m + 1, 1))
    if m:
        gradients[1:] = np.abs(gradients[1:]) * (rng.random((m, n)) < rng.uniform(0.1, 1.0, size=(m, 1)))
    gradients[:, rng.random(n) < 0.15] = 0.0
    room = rng.uniform(-0.02, 0.1, m) * np.abs(gradients[1:]).sum(axis=1)
    return SeparableModel.build(
        x, np.r_[rng.normal(), -room], gradients, lower=np.maximum(0.005, x - rng.uniform(0.05, 0.5)),
        upper=np.minimum(1, x + 0.3),
        distances=np.where(rng.random((m + 1, n)) < 0.5, x, x - 1.5),
        exponents=np.vstack([rng.choice([-3.0, -1.0, 0.0, 0.4, 1.0, 2.0, 4.0], (1, n)), np.ones((m, n))]),
        curvatures=np.vstack([rng.random((1, n)) * (seed % 3 == 0), np.zeros((m, n))]),
    )  # fmt: skip


@settings(max_examples=150, deadline=None)
@given(seed=numbers, n=st.integers(1, 60), m=st.integers(0, 4))
def test_every_subproblem_is_convex_matched_and_solved(seed, n, m):
    model = model_of(seed, n, m)
    values, gradients = model.at(model.point)
    assert np.abs(values - model.values).max() <= MATCH * max(1.0, np.abs(model.values).max())
    assert (np.abs(gradients - model.gradients) <= MATCH * np.abs(model.gradients)).all()
    rng = np.random.default_rng(seed)
    for _ in range(3):
        y = rng.uniform(model.lower, model.upper)
        assert np.isfinite(model.at(y)[0]).all()
        assert (model.second_derivatives(y) >= 0).all()
    solution = solve_subproblem(model)
    assert np.isfinite(solution.x).all()
    assert np.isfinite(solution.multipliers).all()
    assert (solution.multipliers >= 0).all()
    assert ((solution.x >= model.lower) & (solution.x <= model.upper)).all()
    if not solution.elastic:
        assert kkt_residual(model, solution) <= OPTIMAL
    else:  # no point of the box meets the constraints that were missed: budgets are least at the lower ends
        assert (model.at(model.lower)[0][1:] > 0).any()


@settings(max_examples=60, deadline=None)
@given(seed=numbers, n=st.integers(1, 30), m=st.integers(0, 4))
def test_projected_densities_meet_bounds_and_budgets(seed, n, m):
    rng = np.random.default_rng(seed)
    lower = rng.uniform(0, 0.2, n)
    costs = rng.random((m, n)) * (rng.random((m, n)) < 0.6)
    budgets = [(c, float(c @ lower + rng.uniform(0, 1) * c.sum())) for c in costs]
    problem = static_problem(
        lambda a: (float(a.sum()), np.ones(n)),
        start=np.full(n, 0.5),
        lower=lower,
        upper=lower + 0.5,
        budgets=budgets,
    )
    density = problem.into_budgets(rng.uniform(-1, 2, n))
    assert problem.excess(density) <= 1e-12
    assert ((density >= problem.lower) & (density <= problem.upper)).all()


@settings(max_examples=60, deadline=None)
@given(seed=numbers, count=st.integers(1, 12), k=st.integers(2, 4))
def test_only_points_of_the_front_count(seed, count, k):
    points = np.random.default_rng(seed).uniform(size=(count, k))
    kept = pareto_filter(points)
    assert kept.any()
    for i in np.flatnonzero(~kept):
        assert any((points[j] <= points[i]).all() for j in np.flatnonzero(kept))
    assert hypervolume(points, np.ones(k)) == pytest.approx(hypervolume(points[kept], np.ones(k)))
    samples = np.random.default_rng(0).uniform(size=(4000, k))
    covered = (points[:, None, :] <= samples[None]).all(axis=2).any(axis=0).mean()
    assert hypervolume(points, np.ones(k)) == pytest.approx(covered, abs=0.04)  # 5 sigma of 4000 samples
