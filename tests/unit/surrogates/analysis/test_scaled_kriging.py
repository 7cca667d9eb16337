"""Kriging on the scale that predicts best: the choice, the way back, intervals on the user's scale."""

import numpy as np
import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from surrogates import Kriging, ScaledKriging
from tests.plain_kriging import plain


def runs(n=40, seed=0):
    x = np.random.default_rng(seed).random((n, 3))
    return x, np.exp(5 * x[:, 0] + np.sin(5 * x[:, 1]))


@parametrize_with_checks([ScaledKriging(kriging=plain(n_starts=1))])
def test_scikit_learn_contract(estimator, check):
    check(estimator)


def test_decades_are_modelled_by_their_logarithm_and_smooth_responses_as_they_are():
    x, y = runs()
    model = ScaledKriging().fit(x, y)
    assert model.map_.scale == "log"
    assert model.unexplained_["log"] < 0.8 * model.unexplained_["none"]
    assert set(model.unexplained_) == {"none", "log", "box-cox"}
    smooth = ScaledKriging().fit(x, np.sin(3 * x[:, 0]) + x[:, 1] + 4.0)
    assert smooth.map_.scale == "none"
    signed = ScaledKriging().fit(x, np.sin(3 * x[:, 0]) - x[:, 1])
    assert set(signed.unexplained_) == {"none", "yeo-johnson"}


def test_mean_and_deviation_are_those_of_a_lognormal():
    x, y = runs()
    model = ScaledKriging(scale="log", kriging=plain()).fit(x[:12], y[:12])
    m, s = model.kriging_.predict(x[12:20], return_std=True)
    mean, std = model.predict(x[12:20], return_std=True)
    expected = np.exp(m + s**2 / 2)
    # the way back is held at e^3 times the largest run
    small = s < 0.5
    assert small.any()
    assert mean[small] == pytest.approx(expected[small], rel=1e-3)
    assert std[small] == pytest.approx((expected * np.sqrt(np.expm1(s**2)))[small], rel=1e-2)
    assert model.predict(x[12:20]) == pytest.approx(mean)


@pytest.mark.slow
def test_intervals_on_the_scale_of_the_response_hold_new_runs():
    """Six samples of 30 runs."""
    held, wide = [], []
    for seed in range(6):
        x, y = runs(30, seed)
        new, truth = runs(400, 100 + seed)
        model = ScaledKriging().fit(x, y)
        lower, upper = model.predict_interval(new)
        held.append(np.mean((lower <= truth) & (truth <= upper)))
        assert (lower > 0.0).all()
        inner, outer = model.predict_interval(new[:5], level=0.5), (lower[:5], upper[:5])
        assert (inner[0] > outer[0]).all()
        assert (inner[1] < outer[1]).all()
        plain_error = np.mean((Kriging().fit(x, y).predict(new) - truth) ** 2)
        wide.append(np.mean((model.predict(new) - truth) ** 2) / plain_error)
    assert 0.9 <= np.mean(held) <= 1.0
    assert np.median(wide) < 0.5


def test_what_is_refused():
    x, y = runs()
    with pytest.raises(ValueError, match=r"scale needs one of auto, none, log, .*, got 'cube'"):
        ScaledKriging(scale="cube").fit(x, y)
    with pytest.raises(ValueError, match="the logarithm needs responses above 0"):
        ScaledKriging(scale="log").fit(x, y - 50.0)
    with pytest.raises(ValueError, match="level needs a share between 0 and 1, got 95"):
        ScaledKriging(scale="log", kriging=plain(n_starts=1)).fit(x, y).predict_interval(x, level=95)
