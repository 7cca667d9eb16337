"""Kriging does its job: likelihood, prediction, leave-one-out, estimator contract."""

import numpy as np
import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from surrogates import Kriging

ROUNDING = 1e-9  # dense formulas with explicit inverses at condition numbers up to 1e6


def runs(n=25, d=3, seed=0):
    rng = np.random.default_rng(seed)
    x = rng.random((n, d))
    y = np.sin(4 * x[:, 0]) + x[:, 1] * x[:, 2] + 0.3 * x[:, 1]
    return x, y


def dense(x, z, f, theta, power=2.0):
    """C^-1, b and P written out for the Gaussian correlation."""
    r = np.exp(-(theta * np.abs(x[:, None] - x[None]) ** power).sum(-1)) + 1e-6 * np.eye(len(x))
    inverse = np.linalg.inv(r)
    a = f.T @ inverse @ f
    p = inverse - inverse @ f @ np.linalg.inv(a) @ f.T @ inverse
    return r, p, np.linalg.slogdet(a)[1]


@parametrize_with_checks([Kriging()])
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.mark.parametrize("trend", ["constant", "linear"])
@pytest.mark.parametrize("criterion", ["reml", "ml"])
def test_likelihood_is_the_dense_formula_in_the_coordinates_of_x(trend, criterion):
    x, y = runs()
    x = 3.0 + 5.0 * x
    k = Kriging(criterion=criterion, trend=trend, nugget=1e-6).fit(x, y)
    f = np.column_stack([np.ones(len(x)), x])[:, : 1 if trend == "constant" else 4]
    r, p, log_det_trend = dense(x, y, f, k.theta_)
    m = len(y) - f.shape[1] if criterion == "reml" else len(y)
    sigma2 = y @ p @ y / m
    twice = -m * np.log(sigma2) - np.linalg.slogdet(r)[1] - m - (log_det_trend if criterion == "reml" else 0)
    assert k.sigma2_ == pytest.approx(sigma2, rel=1e-6)
    assert k.log_likelihood_ == pytest.approx(0.5 * twice, rel=1e-7)
    assert k.beta_ == pytest.approx(
        np.linalg.lstsq(np.linalg.solve(np.linalg.cholesky(r), f), np.linalg.solve(np.linalg.cholesky(r), y))[
            0
        ],
        rel=1e-5,
    )
