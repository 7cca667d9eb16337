"""The pattern search over mixed coordinates."""

import numpy as np
import pytest

from workbench.search.surrogate.pattern_search import maximise_score, trial_values


def test_trial_values_are_neighbours_and_ends_or_all_of_few_levels():
    grid = np.linspace(0, 1, 51)
    free, few, many = trial_values(np.array([0.5, 0.0, 0.5]), 0.1, [None, np.array([0.0, 0.5, 1.0]), grid])
    assert free.tolist() == [0.0, 0.4, 0.6, 1.0]
    assert few.tolist() == [0.5, 1.0]
    assert many.tolist() == pytest.approx([0.0, 0.4, 0.6, 1.0])


def test_pattern_search_finds_an_interior_maximum_and_a_corner():
    def inside(u):
        return -((u - np.array([0.3, 0.72])) ** 2).sum(axis=1)

    points, values = maximise_score(inside, np.full((1, 2), 0.9), [None, None])
    np.testing.assert_allclose(points[0], [0.3, 0.72], atol=2e-3)
    assert values[0] > -1e-5
    corner, _ = maximise_score(lambda u: u @ np.array([1.0, -2.0, 3.0]), np.full((1, 3), 0.5), [None] * 3)
    assert corner[0].tolist() == [1.0, 0.0, 1.0]


def test_pattern_search_stays_on_levels_and_out_of_forbidden_regions():
    levels = [np.array([0.0, 0.5, 1.0]), None]

    def score(u):
        value = u[:, 0] + u[:, 1]
        return np.where(u[:, 1] > 0.6, -np.inf, value)

    points, values = maximise_score(score, np.array([[0.0, 0.1], [0.5, 0.5]]), levels)
    assert set(points[:, 0]) <= {0.0, 0.5, 1.0}
    assert np.all(points[:, 1] <= 0.6)
    assert values.max() == pytest.approx(1.6, abs=5e-3)
