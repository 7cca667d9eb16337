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
DEGENERATE = 1e-7  # where slopes vanish towards a bound: 5 of 2,000 drawn ones are above 1e-9, by up to eight

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


def wild_model(seed):
    """One row, or rows under a bound, beside budgets, at a design of any scale: slopes over many powers of
    ten, members near their bounds, steep exponents and curvatures, budgets that nothing in the box meets."""
    rng = np.random.default_rng(seed)
    n, m, bound = int(rng.integers(3, 60)), int(rng.integers(1, 9)), rng.random() < 0.6
    width = 10.0 ** rng.uniform(-2, 1, n)
    x = width * rng.random(n) * 10.0 ** rng.uniform(-3, 0, n)
    lower = np.minimum(1e-7 * width, x)
    w = 10.0 ** rng.uniform(-3, 1, (m, n)) * 10.0 ** rng.uniform(-4, 4, (m, 1))
    rows = (w * width / (x + 0.01 * width)).sum(axis=1)
    slopes = -w * width / (x + 0.01 * width) ** 2 * np.where(rng.random((m, n)) < 0.1, -1, 1)
    cost = rng.uniform(0.5, 2, (int(rng.integers(1, 3)), n)) * (rng.random(n) < 0.9)
    over = cost @ x - cost @ (x * rng.uniform(0.7, 1.5))
    if bound:
        t, reach = rows.max(), np.abs(slopes) @ width
        gradients = np.zeros((m + 1 + len(cost), n + 1))
        gradients[0, -1], gradients[1 : m + 1, -1] = 1.0, -1.0
        gradients[1 : m + 1, :n], gradients[m + 1 :, :n] = slopes, cost
        room = 0.1 * reach.max()
        values, x = np.r_[t, rows - t, over], np.r_[x, t]
        lower = np.r_[lower, min(t, t + (rows - t - reach).max() - room)]
        upper = np.r_[width, t + (room if (over <= 0).all() else reach.max())]
    else:
        gradients, values, upper = np.vstack([slopes[:1], cost]), np.r_[rows[0], over], width
    width, falls = upper - lower, gradients < 0
    distances, exponents = np.maximum(x, 1e-3 * width) * np.ones(gradients.shape), np.ones(gradients.shape)
    curvatures = np.zeros(gradients.shape)
    kind = rng.choice(["reciprocal", "asymptotes", "two points", "quadratic"])
    if kind == "reciprocal":
        exponents = np.where(falls, -1.0, 1.0)
    elif kind == "asymptotes":
        reach = 10.0 ** rng.uniform(-2, 0.5) * width
        distances, exponents = np.where(falls, reach, -reach), -exponents
        lower, upper = np.maximum(lower, x - 0.9 * reach), np.minimum(upper, x + 0.9 * reach)
    elif kind == "two points":
        exponents = np.where(falls, rng.uniform(-8, 1, falls.shape), rng.uniform(1, 8, falls.shape))
    else:
        curvatures = np.abs(gradients) / width * 10.0 ** rng.uniform(-6, 8, gradients.shape)
    if bound:
        exponents[:, -1], curvatures[:, -1] = 1.0, 0.0
    return SeparableModel.build(
        x, values, gradients, lower=lower, upper=upper, distances=distances, exponents=exponents,
        curvatures=curvatures,
    )  # fmt: skip


@settings(max_examples=150, deadline=None)
@given(seed=numbers)
def test_subproblems_of_any_scale_are_solved_to_the_last_digits(seed):
    model = wild_model(seed)
    solution = solve_subproblem(model)
    assert ((solution.x >= model.lower) & (solution.x <= model.upper)).all()
    part = model.within_reach()  # steep curvatures leave most of the box unused; its width is no measure
    caps = np.full(model.constraints, np.inf)
    if solution.elastic:  # what cannot be met is paid for at its cap, and the rest is still an optimum
        reach = np.abs(part.gradients) @ (part.upper - part.lower)
        dear = solution.multipliers >= (1 - OPTIMAL) * 1e6 * reach[0] / reach[1:]
        assert dear.any()
        caps[dear] = solution.multipliers[dear]
    assert kkt_residual(part, solution, caps) <= DEGENERATE


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
