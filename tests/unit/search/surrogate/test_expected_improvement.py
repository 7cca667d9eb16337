"""Expected improvement: the integral it stands for, and its logarithm far from the optimum."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from workbench.search.surrogate.expected_improvement import log_expected_improvement

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
