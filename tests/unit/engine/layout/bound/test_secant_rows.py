"""Curvature of rows from designs visited before: exact there, convex, and worth evaluations."""

from dataclasses import replace

import numpy as np
import pytest

from studies.whole_members import random_scenarios
from workbench.engine.layout.bound.secant_rows import VisitedDesigns
from workbench.engine.layout.bound.trust_region import TrustRegionRun
from workbench.engine.layout.formulation.transient import transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.history import Recorder

ROUNDING = 1e-12
MEMBERS, NODES = 7, 12


def bowls(seed, *, sign=1.0):
    """Quadratic rows of two scenarios: values (2, NODES) and gradients (rows, members) at a design."""
    rng = np.random.default_rng(seed)
    slopes = rng.standard_normal((2 * NODES, MEMBERS))
    roots = rng.standard_normal((2 * NODES, MEMBERS, MEMBERS))
    curved = sign * roots @ roots.transpose(0, 2, 1)

    def values(x):
        return (slopes @ x + 0.5 * np.einsum("i,rij,j->r", x, curved, x)).reshape(2, NODES)

    return values, lambda x: slopes + curved @ x, rng


def visited(values, designs):
    found = VisitedDesigns()
    for x in designs:
        found.add(x, values(x))
    return found


def model(found, x, values, gradients, way, *, reach=10.0):
    rows = np.arange(2 * NODES)
    near = found.near(x, np.full(MEMBERS, reach))
    W = found.factors(near, x, values(x), rows, gradients(x))
    assert W.shape == (2 * NODES, len(near), MEMBERS)
    return values(x).ravel() + gradients(x) @ way + 0.5 * ((W @ way) ** 2).sum(axis=1)


def test_rows_that_bend_upwards_are_exact_at_the_nearest_design():
    values, gradients, rng = bowls(1)
    x = rng.random(MEMBERS)
    near, far = x + 0.1 * rng.standard_normal(MEMBERS), x + 0.8 * rng.standard_normal(MEMBERS)
    found = visited(values, [far, x, near])
    assert found.near(x, np.full(MEMBERS, 10.0)) == [2, 0]
    there = model(found, x, values, gradients, near - x)
    # what the farther design adds along the way to the nearer one is no less than nothing
    alone = model(visited(values, [near]), x, values, gradients, near - x)
    np.testing.assert_allclose(alone, values(near).ravel(), rtol=ROUNDING, atol=1e-10)
    assert (there >= values(near).ravel() - 1e-10).all()
    np.testing.assert_allclose(model(found, x, values, gradients, 0 * x), values(x).ravel(), rtol=ROUNDING)


def test_the_farther_design_makes_up_for_what_the_nearer_ones_do_not_explain():
    values, gradients, rng = bowls(2)
    x = rng.random(MEMBERS)
    way = rng.standard_normal(MEMBERS)
    found = visited(values, [x + 0.1 * way, x + 0.3 * way])  # of one line: the second says nothing new
    there = model(found, x, values, gradients, 0.3 * way)
    np.testing.assert_allclose(there, values(x + 0.3 * way).ravel(), rtol=1e-9, atol=1e-9)


def test_rows_that_bend_downwards_stay_straight():
    values, gradients, rng = bowls(3, sign=-1.0)
    x, way = rng.random(MEMBERS), rng.standard_normal(MEMBERS)
    there = model(visited(values, [x + way]), x, values, gradients, way)
    np.testing.assert_allclose(there, values(x).ravel() + gradients(x) @ way, rtol=ROUNDING)


def test_designs_out_of_reach_and_the_design_itself_are_left_out_and_old_ones_forgotten():
    values, _, rng = bowls(4)
    x = rng.random(MEMBERS)
    found = visited(values, [x + k for k in range(-1, 19)])
    assert len(found.densities) == 12
    assert [found.densities[i][0] - x[0] for i in found.near(x + 9, np.full(MEMBERS, 0.5))] == [
        pytest.approx(d) for d in (8, 10)
    ]
    assert found.near(x - 1, np.full(MEMBERS, 0.5)) == []


def test_peaks_of_the_designs_near_by_are_rows_of_the_problem():
    found = VisitedDesigns()
    found.add(np.zeros(2), np.array([[0.0, 3.0, 1.0], [0.0, 1.0, 0.0]]))
    assert found.peaks([0], above=2.0).tolist() == [1]
    assert found.peaks([], above=2.0).tolist() == []


def by_sweeps(seed):
    rng = np.random.default_rng(seed)
    scenarios, _ = random_scenarios(seed, most=1500)
    n = len(scenarios[0].system.members)
    return transient_problem(
        scenarios, start=rng.uniform(0.05, 1.0, n), lower=1e-3, budgets=[(np.ones(n), 0.4 * n)],
        sensitivities="adjoint",
    )  # fmt: skip


def test_searches_end_at_optima_after_fewer_evaluations(monkeypatch):
    def evaluations():
        found = [
            optimise_layout(by_sweeps(seed), max_evaluations=40, compare=False, multi_start=False)
            for seed in range(40, 48)
        ]
        return np.array([result.evaluations for result in found]), [result.kkt for result in found]

    bent, errors = evaluations()
    monkeypatch.setattr(VisitedDesigns, "near", lambda *_: [])
    straight, _ = evaluations()
    assert bent.sum() < 0.85 * straight.sum()
    assert np.median(errors) < 1e-5


def test_a_refused_step_takes_no_sweeps_again():
    problem, asked = by_sweeps(41), []
    real = problem.evaluate

    class Counted:
        def __init__(self, evaluation):
            self.inner = evaluation

        def __getattr__(self, name):
            return getattr(self.inner, name)

        def gradients(self, rows):
            asked.append(set(rows.tolist()))
            return self.inner.gradients(rows)

    problem = replace(problem, evaluate=lambda x: Counted(real(x)))
    x = problem.into_budgets(problem.start)
    run = TrustRegionRun(
        problem=problem, recorder=Recorder(problem), density=x, evaluation=problem.evaluate(x),
        tolerance=1e-6, radius=0.3,
    )  # fmt: skip
    values = np.atleast_2d(run.evaluation.values)
    run._model_step(values)
    first = set.union(*asked)
    asked.clear()
    run.radius = 0.1
    run._model_step(values)
    assert not first & set().union(*asked)
