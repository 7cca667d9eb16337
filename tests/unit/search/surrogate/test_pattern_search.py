"""Acquisition scores and the pattern search over mixed coordinates."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from workbench.search.surrogate.pattern_search import log_expected_improvement, maximise_score, proposals

QUADRATURE = 1e-9  # accuracy of scipy's adaptive quadrature on a smooth integrand


@pytest.mark.parametrize(("mean", "std", "best"), [(0, 1, 0), (2, 0.5, 1), (-1, 2, 1), (0, 1, 6)])
def test_expected_improvement_is_the_integral_of_the_improvement(mean, std, best):
    integral, _ = quad(lambda y: (y - best) * norm.pdf(y, mean, std), best, mean + 12 * std)
    ours = np.exp(log_expected_improvement(np.array([float(mean)]), np.array([float(std)]), best)[0])
    assert ours == pytest.approx(integral, rel=1e-7, abs=QUADRATURE)


def test_log_expected_improvement_keeps_its_slope_far_below_the_best():
    far = log_expected_improvement(np.array([-50.0, -49.0, -1e6]), np.ones(3), 0.0)
    assert np.all(np.isfinite(far))
    assert far[1] > far[0] > far[2]
    assert far[0] == pytest.approx(-0.5 * 50**2 - 0.5 * np.log(2 * np.pi) - 2 * np.log(50), abs=1e-2)


def test_log_expected_improvement_rises_with_mean_and_std():
    mean = np.linspace(-5, 5, 101)
    assert np.all(np.diff(log_expected_improvement(mean, np.ones(101), 0.0)) > 0)
    assert np.all(np.diff(log_expected_improvement(np.zeros(101), np.linspace(0.1, 3, 101), 1.0)) > 0)


def test_a_certain_point_below_the_best_has_no_expected_improvement():
    assert log_expected_improvement(np.zeros(1), np.zeros(1), 1.0)[0] < -1e5


def test_proposals_are_neighbours_and_ends_or_all_of_few_levels():
    grid = np.linspace(0, 1, 51)
    free, few, many = proposals(np.array([0.5, 0.0, 0.5]), 0.1, [None, np.array([0.0, 0.5, 1.0]), grid])
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
