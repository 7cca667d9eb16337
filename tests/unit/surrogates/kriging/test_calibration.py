"""The factor on prediction intervals, against its formulas and refits made by hand."""

import numpy as np
import pytest
from scipy import stats

from surrogates.kriging.calibration import (
    FOLDS,
    PRIOR_ERRORS,
    _conformal_factor,
    _predictive_factor,
)
from tests.plain_kriging import plain


def table(n, d=2, seed=0):
    x = np.random.default_rng(seed).random((n, d))
    return x, np.sin(5 * x[:, 0]) + x[:, 1] ** 2


def factor(n, **settings):
    x, y = table(n)
    return plain(intervals="calibrated", n_starts=2, **settings).fit(x, y).interval_factor_


def test_a_wider_factor_is_the_conformal_quantile():
    errors = np.arange(1.0, 41.0)  # 40 errors: rank ceil(0.95 * 41) = 39
    assert _conformal_factor(errors) * stats.norm.ppf(0.975) == pytest.approx(39.0)
    assert _conformal_factor(errors[:15]) * stats.norm.ppf(0.975) == pytest.approx(15.0)


def test_a_narrower_factor_holds_95_percent_of_the_next_error():
    """Of normal errors whose spread is drawn from its prior, an inverse chi-square law."""
    rng = np.random.default_rng(1)
    inside = []
    for _ in range(4000):
        spread = np.sqrt(PRIOR_ERRORS / rng.chisquare(PRIOR_ERRORS))
        errors = spread * rng.standard_normal(21)
        half = _predictive_factor(errors[:20]) * stats.norm.ppf(0.975)
        inside.append(abs(errors[20]) < half)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.011)  # three standard errors


def test_up_to_twenty_runs_every_run_is_left_out_by_itself():
    x, y = table(16)
    kriging = plain(intervals="calibrated", n_starts=2).fit(x, y)
    bare = plain(theta_start=kriging.theta_, n_starts=1)
    errors = []
    for i in range(16):
        rest = np.arange(16) != i
        bare.fit(x[rest], y[rest])
        mean, std = bare.predict(x[i : i + 1], return_std=True)
        errors.append(abs(y[i] - mean[0]) / np.sqrt(std[0] ** 2 + bare.nugget_ * bare.sigma2_))
    wider = _conformal_factor(np.array(errors))
    expected = wider if wider >= 1.0 else min(1.0, _predictive_factor(np.array(errors)))
    assert kriging.interval_factor_ == pytest.approx(expected, rel=1e-6)


def test_fewer_than_ten_runs_are_not_judged():
    assert factor(9) == 1.0
    assert factor(10) != 1.0


def test_the_folds_are_a_function_of_the_seed():
    assert factor(3 * FOLDS, seed=1) == factor(3 * FOLDS, seed=1)
    assert factor(3 * FOLDS, seed=1) != factor(3 * FOLDS, seed=2)
