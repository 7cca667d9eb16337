"""The first-order certificate: by sorting where there is one row, the same as by HiGHS."""

import numpy as np
import pytest

from workbench.engine.layout.formulation.problem import static_problem
from workbench.engine.layout.outcome import optimality
from workbench.engine.layout.outcome.optimality import certificate

SOLVER = 1e-6  # relative: the tolerances of the linear programme


def drawn(rng, *, members, budgets):
    """A design within its budgets, of members in one budget each or in none."""
    lower = rng.uniform(0.0, 0.2, members)
    upper = lower + rng.uniform(0.0, 1.0, members) * (rng.random(members) < 0.9)  # some are fixed
    density = lower + rng.random(members) * (upper - lower)
    home = rng.integers(-1, budgets, members)
    costs = rng.uniform(0.2, 3.0, members) * (home == np.arange(budgets)[:, None])
    limits = costs @ density * rng.uniform(1.0, 1.3, budgets) + 1e-9
    given = [(cost, limit) for cost, limit in zip(costs, limits, strict=True)]
    problem = static_problem(
        lambda x: (1.0, np.ones(members)), start=density, lower=lower, upper=upper, budgets=given
    )
    gradient = rng.standard_normal(members) * (rng.random(members) < 0.8)  # some do nothing
    return problem, density, gradient


def certified(problem, density, gradient):
    none = np.zeros(0), np.zeros((0, problem.members))
    return certificate(problem, density, np.array([2.0]), gradient[None], *none)


@pytest.mark.parametrize("seed", range(12))
def test_sorting_agrees_with_the_linear_programme(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    problem, density, gradient = drawn(rng, members=int(rng.integers(2, 60)), budgets=1 + seed % 3)
    sorted_, scale = certified(problem, density, gradient), np.abs(gradient).max() + 1e-12
    monkeypatch.setattr(optimality, "_parts_budgets", lambda problem: False)
    solved = certified(problem, density, gradient)
    assert sorted_.kkt == pytest.approx(solved.kkt, rel=SOLVER, abs=SOLVER * scale)
    gains = [float(gradient @ (found.vertex - density)) for found in (sorted_, solved)]
    assert gains[0] == pytest.approx(gains[1], rel=SOLVER, abs=SOLVER * scale)
    assert -gains[0] == pytest.approx(2.0 * sorted_.kkt, rel=1e-9, abs=1e-12)  # no gap to its own bound
    assert (problem.costs @ sorted_.vertex <= problem.limits + 1e-9).all()
    assert (sorted_.vertex >= problem.lower - 1e-12).all()
    assert (sorted_.vertex <= problem.upper + 1e-12).all()


def test_prices_are_what_a_little_more_budget_gains():
    rng = np.random.default_rng(3)
    problem, density, gradient = drawn(rng, members=40, budgets=2)
    found = certified(problem, density, gradient)
    for j in range(2):
        more = problem.limits.copy()
        more[j] += 1e-6
        wider = static_problem(
            lambda x: (1.0, np.ones(40)), start=density, lower=problem.lower, upper=problem.upper,
            budgets=list(zip(problem.costs, more, strict=True)),
        )  # fmt: skip
        gained = 2.0 * (certified(wider, density, gradient).kkt - found.kkt)
        assert gained == pytest.approx(1e-6 * found.shadow_prices[j], rel=1e-6, abs=1e-14)


def test_a_hundred_thousand_members_far_from_the_optimum_are_no_linear_programme(monkeypatch):
    monkeypatch.setattr(optimality, "linear_programme", None)
    rng = np.random.default_rng(1)
    problem, density, gradient = drawn(rng, members=100_000, budgets=1)
    assert certified(problem, density, gradient).kkt > 0.0
