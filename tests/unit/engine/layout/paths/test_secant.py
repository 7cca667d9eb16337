"""Curvature learnt from gradients, row by row."""

import numpy as np
import pytest

from workbench.engine.layout.paths.secant import SecantMemory, _learnt


def test_every_row_is_learnt_in_its_own_scale():
    # rows sum c_i/x_i + (v'x)^2/2: what a move says of one row must not blur the other
    rng = np.random.default_rng(2)
    c = 10.0 ** rng.uniform(-1, 1, (2, 6))

    def gradients(x):
        return -c / x**2

    memory, x = SecantMemory(), np.full(6, 0.5)
    for _ in range(8):
        there = x * rng.uniform(0.9, 1.1, 6)
        memory.add(x, gradients(x), there, gradients(there))
        x = there
    weights = np.array([0.3, 0.7])
    learnt = memory.curvature(x, gradients(x), weights)
    step = x * rng.uniform(-1, 1, 6)
    assert learnt.times(step) == pytest.approx(weights @ (2 * c / x**3) * step, rel=0.02)


def test_a_row_without_weight_adds_nothing_and_no_moves_give_a_share_of_the_prior():
    gradients = np.array([[-1.0, -2.0], [-5.0, -5.0]])
    first = SecantMemory().curvature(np.full(2, 0.5), gradients, np.array([1.0, 0.0]))
    assert first.times(np.ones(2)) == pytest.approx([0.7 * 4.0, 0.7 * 8.0])
    assert first.columns.shape == (2, 0)


def projection(rng, n=30, rank=4):
    axes = np.linalg.qr(rng.standard_normal((n, rank)))[0]
    return axes @ axes.T


def moves(rng, hessian, count):
    found = []
    for _ in range(count):
        s = rng.standard_normal(len(hessian))
        s /= np.linalg.norm(s)
        found.append((s, hessian @ s))
    return found


def test_two_directions_of_a_projection_are_learnt_of_each_move():
    rng = np.random.default_rng(4)
    P = projection(rng)
    learnt, share = _learnt(moves(rng, P, 10), np.ones(30), 1.0, 1.0)
    step = rng.standard_normal(30)
    assert learnt.times(P @ step) == pytest.approx(P @ step, abs=1e-9)
    assert share == pytest.approx(0.05)  # what was new in the last moves did not bend
    assert np.linalg.norm(learnt.times(step) - P @ step) <= 0.06 * np.linalg.norm(step)


def test_refused_steps_raise_what_is_not_known_before_what_is():
    rng = np.random.default_rng(5)
    P = projection(rng)
    pairs, step = moves(rng, P, 10), P @ rng.standard_normal(30)
    unknown = np.linalg.qr(np.column_stack([np.array(pairs).reshape(-1, 30).T, np.eye(30)]))[0][:, 15]
    once, _ = _learnt(pairs, np.ones(30), 0.05, 1.0)
    again, _ = _learnt(pairs, np.ones(30), 0.05, 4.0)
    most, _ = _learnt(pairs, np.ones(30), 0.05, 40.0)
    assert again.times(step) == pytest.approx(once.times(step))
    assert most.times(step) == pytest.approx(2 * once.times(step))  # 40 shares of 0.05
    assert unknown @ again.times(unknown) == pytest.approx(4 * unknown @ once.times(unknown), rel=0.3)


def test_a_row_that_is_no_projection_keeps_the_prior_where_moves_bend_by_it():
    rng = np.random.default_rng(6)
    hessian = np.diag(rng.uniform(0.5, 1.0, 30))
    learnt, share = _learnt(moves(rng, hessian, 5), np.ones(30), 1.0, 1.0)
    assert share >= 0.7
    step = rng.standard_normal(30)
    assert step @ learnt.times(step) >= 0.8 * step @ hessian @ step


def test_many_members_use_fewer_moves():
    rng = np.random.default_rng(7)
    memory, x = SecantMemory(), np.full(50_000, 0.5)
    for _ in range(60):
        there = x * rng.uniform(0.95, 1.05, len(x))
        memory.add(x, (-1 / x**2)[None], there, (-1 / there**2)[None])
        x = there
    assert memory.curvature(x, (-1 / x**2)[None], np.ones(1)).columns.shape[1] <= 100
