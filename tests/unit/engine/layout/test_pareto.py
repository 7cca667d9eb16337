"""Fronts of two and three objectives: tools, the trusses' front, weighted and boundary problems."""

from itertools import pairwise

import numpy as np
import pytest

from studies import trusses
from workbench.engine.layout.formulation.combined import boundary_problem, weighted_problem
from workbench.engine.layout.formulation.problem import InvalidLayout, static_problem
from workbench.engine.layout.pareto import hypervolume, knee_point, pareto_filter
from workbench.engine.layout.several import front, simplex_points


def quadratic_objectives(centres):
    def one(c):
        return static_problem(
            lambda a: (float(1 + ((a - c) ** 2).sum()), 2 * (a - c)), start=np.full(3, 0.4), lower=0.0,
            budgets=[(np.ones(3), 3.0)],
        )  # fmt: skip

    return [one(np.array(c)) for c in centres]


def test_a_front_of_three_objectives_by_normal_constraints():
    # distances from the corners of an equilateral triangle: the Pareto set is the triangle itself
    corners = np.array([[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]])
    found = front(
        quadratic_objectives(corners), points=10, method="normal_constraint", max_evaluations=40,
        tolerance=1e-8,
    )  # fmt: skip
    assert found.values.shape == (10, 3)
    assert found.kept.all()
    for density, x in zip(found.densities, found.weights, strict=True):
        inside = np.linalg.solve(corners.T, density)
        assert inside.min() > -2e-3  # in the triangle
        assert inside.sum() == pytest.approx(1.0, abs=2e-3)
        assert x.sum() == pytest.approx(1.0)
    # points of the simplex that lie apart give layouts that lie apart
    apart = np.linalg.norm(found.densities[:, None] - found.densities[None], axis=2)
    assert apart[np.triu_indices(10, 1)].min() > 0.1
    # a point between two anchors, X = (1/3, 2/3, 0), has no component of the third
    for density, x in zip(found.densities, found.weights, strict=True):
        if x.max() < 0.9 and x.min() == 0:
            assert np.linalg.solve(corners.T, density)[np.argmin(x)] == pytest.approx(0.0, abs=5e-3)


def test_pareto_tools():
    points = np.array([[1.0, 4.0], [2.0, 2.0], [4.0, 1.0], [3.0, 3.0]])
    assert pareto_filter(points).tolist() == [True, True, True, False]
    assert hypervolume(points, [5, 5]) == pytest.approx(4 + 3 * 2 + 1 * 1)  # strips above each point
    assert hypervolume([[0, 0, 0], [0.5, 0.5, -1]], [1, 1, 1]) == pytest.approx(1 + 0.25)
    assert hypervolume([[9, 9]], [5, 5]) == 0.0
    assert knee_point(points[:3]) == 1


def test_a_truss_front_is_convex_even_and_exact():
    truss = [
        trusses.ground_structure(columns=4, rows=3, width=3.0, height=2.0, loads=(((force, (3.0, 1.0)),),))
        for force in ((0.0, -1.0), (1.0, 0.0))
    ]
    found = front([trusses.problem(t) for t in truss], points=7, max_evaluations=40)
    assert found.kept.all()
    assert found.spacing == pytest.approx(np.ones(6), abs=0.25)
    assert 0.5 < found.covered <= 1.0
    # convex objectives: no layout between two neighbours may lie clearly below the front
    order = np.argsort(found.values[:, 0])
    problems = [trusses.problem(t) for t in truss]
    for i, j in pairwise(order):
        middle = 0.5 * (found.densities[i] + found.densities[j])
        values = np.array([float(p.evaluate(middle).values.max()) for p in problems])
        assert not (values < 0.999 * found.values[i]).all()


def test_weighted_and_boundary_problems_have_true_gradients():
    rng = np.random.default_rng(1)
    truss = [
        trusses.ground_structure(columns=3, rows=3, width=2.0, height=2.0, loads=(((force, (2.0, 1.0)),),))
        for force in ((0.0, -1.0), (1.0, 0.0))
    ]
    problems = [trusses.problem(t) for t in truss]
    a = problems[0].start * rng.uniform(0.8, 1.2, problems[0].members)
    low, high = np.zeros(2), np.array([50.0, 20.0])
    targets = (
        weighted_problem(problems, [0.4, 0.6], power=2.0, utopia=low, nadir=high),
        boundary_problem(problems, low, high),
    )
    for target in targets:
        evaluation = target.evaluate(a)
        d = rng.normal(size=len(a)) * a
        h = 1e-5
        plus, minus = (target.evaluate(a + s * h * d) for s in (1, -1))
        rows = np.arange(evaluation.values.size)
        slope = (plus.values - minus.values).ravel() / (2 * h)
        assert evaluation.gradients(rows) @ d == pytest.approx(slope, rel=1e-6)
        bend = (plus.gradients(rows) - minus.gradients(rows)) @ d / (2 * h)
        assert ((evaluation.factors(rows) @ d) ** 2).sum(axis=1) == pytest.approx(bend, rel=1e-5)


def test_fronts_refuse_what_they_cannot_do():
    (problem,) = quadratic_objectives([np.full(3, 0.2)])
    other = static_problem(
        lambda a: (float(a.sum()), np.ones(3)), start=np.full(3, 0.2), lower=0.1, budgets=[(np.ones(3), 3.0)]
    )
    with pytest.raises(InvalidLayout, match="need at least 2, got 1"):
        front([problem])
    with pytest.raises(InvalidLayout, match="objective 1 has other lower than objective 0"):
        front([problem, other])
    with pytest.raises(InvalidLayout, match="'boundary', 'normal_constraint' or 'weighted', got 'random'"):
        front([problem, problem], method="random")
    with pytest.raises(InvalidLayout, match="needs at least 3 points, got 2"):
        front([problem, problem], points=2)
    with pytest.raises(InvalidLayout, match="do not conflict"):
        front([problem, problem])
    with pytest.raises(InvalidLayout, match="weights need a positive number"):
        weighted_problem([problem, problem], [1.0, 0.0], power=1.0, utopia=np.zeros(2), nadir=np.ones(2))
    with pytest.raises(InvalidLayout, match="power needs to be >= 1"):
        weighted_problem([problem, problem], [1.0, 1.0], power=0.5, utopia=np.zeros(2), nadir=np.ones(2))


def test_simplex_points_of_three_objectives():
    grid = simplex_points(3, 10)
    assert len(grid) == 10
    assert grid.sum(axis=1) == pytest.approx(np.ones(10))
