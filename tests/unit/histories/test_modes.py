"""Modes of histories: what went in comes out, with its share."""

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns
from workbench.histories.modes import modes_of, time_weights

T = np.sort(np.r_[0.0, 1.0, np.random.default_rng(0).uniform(0, 1, 199)])  # uneven on purpose


@pytest.mark.parametrize("seed", range(3))
def test_known_shapes_and_shares_come_back(seed):
    rng = np.random.default_rng(seed)
    weights = time_weights(T)
    basis, _ = np.linalg.qr((np.array([np.sin(7 * T), T**2, np.cos(30 * T)]) * np.sqrt(weights)).T)
    shapes = basis.T / np.sqrt(weights)
    scores, _ = np.linalg.qr(rng.standard_normal((40, 4)))  # independent, and of mean zero without the first
    scores = scores[:, 1:] - scores[:, 1:].mean(axis=0)
    scores, _ = np.linalg.qr(scores)
    scores *= [5.0, 3.0, 1.0]
    found = modes_of(np.sin(T) + scores @ shapes, T, count=5)
    assert found.shares == pytest.approx(np.array([25, 9, 1]) / 35)
    assert found.deviations == pytest.approx(np.array([5, 3, 1]) / np.sqrt(39))
    assert found.runs == 40
    np.testing.assert_allclose(np.abs((found.shapes * weights) @ shapes.T), np.eye(3), atol=1e-9)
    assert (found.shapes.max(axis=1) == np.abs(found.shapes).max(axis=1)).all()
    new = found.mean + np.array([[0.5, -2.0, 7.0]]) @ found.shapes
    np.testing.assert_allclose(found.scores(new), [[0.5, -2.0, 7.0]], atol=1e-12)


def test_the_steps_of_time_do_not_decide():
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((2, 30, 1))

    def histories(t):
        return a * np.sin(3 * t) + 0.3 * b * np.exp(-t)

    fine, dense_at_the_end = np.linspace(0, 1, 2001), 1 - np.linspace(1, 0, 2001) ** 3
    one, two = (modes_of(histories(t), t, count=2) for t in (fine, dense_at_the_end))
    np.testing.assert_allclose(one.shares, two.shares, rtol=1e-4)
    scores = one.scores(histories(fine))
    np.testing.assert_allclose(scores, two.scores(histories(dense_at_the_end)), atol=1e-4)


def test_what_has_no_modes():
    with pytest.raises(NotEnoughRuns, match="modes need two histories or more, got 1"):
        modes_of(np.ones((1, 5)), np.arange(5.0), count=2)
    with pytest.raises(NotEnoughRuns, match="the 3 histories are the same: they have no modes"):
        modes_of(np.ones((3, 5)) * 0.1, np.arange(5.0), count=2)
    assert modes_of(np.outer([1, 2, 4], np.ones(5)), np.arange(5.0), count=2).shares == pytest.approx([1])
    assert modes_of(np.array([[1.0], [2.0]]), np.array([3.0]), count=2).shares == pytest.approx([1])
