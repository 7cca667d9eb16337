"""Curvature learnt from gradients, row by row."""

import numpy as np
import pytest

from workbench.engine.layout.bound.secant import SecantMemory


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


def test_a_row_without_weight_adds_nothing_and_no_moves_give_the_prior():
    gradients = np.array([[-1.0, -2.0], [-5.0, -5.0]])
    first = SecantMemory().curvature(np.full(2, 0.5), gradients, np.array([1.0, 0.0]))
    assert first.times(np.ones(2)) == pytest.approx([4.0, 8.0])
    assert first.columns.shape == (2, 0)
