"""Compliances between two bounds: what holds at every design, and what is no compliance."""

from dataclasses import replace

import numpy as np
import pytest

from studies import trusses
from workbench.engine.layout.formulation.problem import static_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.paths import compliance
from workbench.engine.layout.paths.compliance import ComplianceModel, are_compliances
from workbench.engine.layout.paths.secant import SecantModel

LOADS = ((((0, -1), (3.0, 1.0)),), (((1, 0), (3.0, 2.0)),), (((0.6, 0.8), (2.0, 0.0)),))


def truss(cases=2, **size):
    grid = {"columns": 4, "rows": 3, "width": 3.0, "height": 2.0} | size
    return trusses.ground_structure(loads=LOADS[:cases], **grid)


def learnt_along_a_path(t, moves, rng):
    """A model that saw small moves, and the design where it is placed."""
    x = rng.uniform(0.5, 1.5, len(t.ends)) / t.lengths.sum()
    model = ComplianceModel(free=np.full(len(x), True))
    weights = np.full(t.loads.shape[1], 0.5)
    for _ in range(moves):
        values, gradients, _ = t.compliances(x)
        model.place(x, values, gradients, weights)
        there = x * rng.uniform(0.97, 1.03, len(x))
        values, gradients, _ = t.compliances(there)
        assert model.learn(there, values, gradients, taken=True)
        x = there
    values, gradients, _ = t.compliances(x)
    model.place(x, values, gradients, weights)
    return model, x


def test_both_bounds_hold_and_meet_where_the_model_stands():
    t, rng = truss(), np.random.default_rng(2)
    model, x = learnt_along_a_path(t, 6, rng)
    values, gradients, _ = t.compliances(x)
    here = model.at(np.zeros(len(x)), np.array([0.5, 0.5]))
    np.testing.assert_allclose(here.values, values, rtol=1e-10)
    np.testing.assert_allclose(here.slopes, gradients, rtol=1e-7, atol=1e-9 * np.abs(gradients).max())
    for _ in range(20):
        there = x * rng.uniform(0.8, 1.25, len(x))
        values, _, _ = t.compliances(there)
        for row, value in zip(model.rows, values, strict=True):
            bounds = row.bounds(there)
            assert bounds.below <= value * (1 + 1e-9)
            assert value <= bounds.above * (1 + 1e-9)


def test_after_as_many_moves_as_free_coordinates_the_lower_bound_is_the_compliance():
    t, rng = truss(1), np.random.default_rng(3)
    model, x = learnt_along_a_path(t, 2 * t.rows.shape[1], rng)
    there = x * rng.uniform(0.8, 1.25, len(x))
    values, gradients, _ = t.compliances(there)
    bounds = model.rows[0].bounds(there)
    assert bounds.below == pytest.approx(values[0], rel=1e-5)
    np.testing.assert_allclose(-(bounds.elongation**2), gradients[0], atol=1e-3 * np.abs(gradients).max())


def test_the_curvature_is_that_of_the_values_and_slopes():
    t, rng = truss(), np.random.default_rng(4)
    model, x = learnt_along_a_path(t, 5, rng)
    weights, step = np.array([0.3, 0.7]), 0.05 * x * rng.standard_normal(len(x))
    way, h = x * rng.standard_normal(len(x)), 1e-6
    up, down, mid = (model.at(step + k * h * way, weights) for k in (1, -1, 0))
    np.testing.assert_allclose((up.values - down.values) / (2 * h), mid.slopes @ way, rtol=1e-6)
    bends = mid.diagonal * way + mid.columns @ (mid.columns.T @ way)
    np.testing.assert_allclose(
        weights @ (up.slopes - down.slopes) / (2 * h), bends, rtol=1e-5, atol=1e-5 * np.abs(bends).max()
    )


def test_a_displacement_with_wrong_signs_bounds_nothing(monkeypatch):
    monkeypatch.setattr(compliance, "settled_signs", lambda table: table)
    t, rng = truss(1), np.random.default_rng(7)
    seen = []
    for x in rng.uniform(0.5, 1.5, (6, len(t.ends))):
        values, gradients, _ = t.compliances(x)
        u = np.linalg.solve((t.rows.T * (x / t.lengths)) @ t.rows, t.loads[:, 0])
        e = t.rows @ u / np.sqrt(t.lengths)
        seen.append(compliance._Seen(x=x, value=float(values[0]), elongation=e))
    row = compliance._Row(table=seen)
    row.place(x, float(values[0]), gradients[0])
    assert row.basis.shape[1] == 6
    assert row.works == pytest.approx([0.0], abs=1e-10)
    turned = seen[2].elongation.copy()
    turned[(x * turned**2).argmax()] *= -1
    row.table[2] = replace(seen[2], elongation=turned)
    row.place(x, float(values[0]), gradients[0])
    assert row.basis.shape[1] == 5
    np.testing.assert_allclose(row.bounds(seen[1].x).below, seen[1].value, rtol=1e-9)
    assert row.bounds(seen[2].x).below < (1 - 1e-6) * seen[2].value


def test_refused_steps_end_at_the_upper_bound():
    t = truss(1)
    model, x = learnt_along_a_path(t, 3, np.random.default_rng(5))
    while model.stiffen():
        pass
    rows = model.at(0.1 * x, np.ones(1))
    assert rows.values[0] == pytest.approx(model.rows[0].bounds(1.1 * x).above)
    assert rows.columns.shape[1] == 0
    for _ in range(40):
        model.relax()
    assert model.stiff == 1.0


def test_idle_and_vanished_members_do_no_harm():
    t, x = truss(1), np.ones(len(truss(1).ends))
    values, gradients, _ = t.compliances(x)
    x[3], gradients[0, 3] = 0.0, 0.0
    free = x > 0
    model = ComplianceModel(free=free)
    model.place(x, values, gradients, np.ones(1))
    rows = model.at(np.zeros(int(free.sum())), np.ones(1))
    assert np.isfinite(rows.values).all()
    assert np.isfinite(rows.columns).all()


def test_rows_that_rise_or_are_not_homogeneous_are_no_compliances():
    t, x = truss(1), np.ones(len(truss(1).ends))
    values, gradients, _ = t.compliances(x)
    assert are_compliances(x, values, gradients)
    assert not are_compliances(x, values + 0.1, gradients)
    rising = gradients.copy()
    rising[0, 2] = 1.0
    assert not are_compliances(x, values + x[2] * 2, rising)
    assert not are_compliances(x, -values, -gradients)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sum", "norm", "separable"])
def test_rows_that_only_look_like_compliances_come_to_their_optimum(kind, monkeypatch):
    """Falling and homogeneous: a sum of three, a norm of three, and sum c_i/x_i, which is one."""
    t = truss(3, columns=7, rows=3)
    n = len(t.ends)
    costs = np.random.default_rng(6).uniform(0.5, 2.0, n)

    def row(x):
        values, gradients, _ = t.compliances(x)
        if kind == "sum":
            return float(values.sum()), gradients.sum(axis=0)
        if kind == "norm":
            value = float((values**4).sum() ** 0.25)
            return value, (values / value) ** 3 @ gradients
        return float((costs / x).sum()), -costs / x**2

    placed = []
    place = SecantModel.place
    monkeypatch.setattr(SecantModel, "place", lambda *a: (placed.append(1), place(*a))[1])
    problem = static_problem(
        row, start=np.full(n, 1 / t.lengths.sum()), budgets=[(t.lengths, 1.0)], lower=0.0, convex=True
    )
    found = optimise_layout(problem, max_evaluations=120, tolerance=1e-6)
    assert bool(placed) == (kind != "separable")
    assert found.kkt <= 1e-4
    if kind == "separable":
        assert found.value == pytest.approx(np.sqrt(costs * t.lengths).sum() ** 2, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("cases", [1, 3])
def test_gradients_alone_reach_the_last_digits_soon(cases):
    t = truss(cases, columns=7, rows=5)
    exact = optimise_layout(trusses.problem(t), max_evaluations=100, tolerance=1e-10).value
    found = optimise_layout(trusses.problem(t, second_order=False), max_evaluations=60)
    assert found.value <= (1 + 1e-6) * exact
    assert found.kkt <= 1e-3


def test_many_members_keep_shorter_tables(monkeypatch):
    monkeypatch.setattr(compliance, "_NUMBERS", 2000)
    n, rng = 100, np.random.default_rng(8)
    model, x = ComplianceModel(free=np.full(n, True)), np.full(n, 0.5)
    for _ in range(30):
        model.place(x, np.array([(1 / x).sum()]), (-1 / x**2)[None], np.ones(1))
        x = x * rng.uniform(0.95, 1.05, n)
        assert model.learn(x, np.array([(1 / x).sum()]), (-1 / x**2)[None], taken=True)
    assert len(model.rows[0].table) == 20
