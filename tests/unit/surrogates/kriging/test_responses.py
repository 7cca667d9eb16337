"""Several responses with one theta, and the choice of a trend."""

import numpy as np
import pytest

from surrogates import SharedKriging, TooFewRuns, choose_trend
from tests.plain_kriging import plain


def runs(n=30, d=3, seed=0):
    rng = np.random.default_rng(seed)
    x = rng.random((n, d))
    return x, np.column_stack([np.sin(4 * x[:, 0]), 3 + 10 * np.cos(4 * x[:, 0] + x[:, 1]), np.full(n, 2.0)])


def test_shared_theta_maximises_the_sum():
    x, y = runs()
    shared = SharedKriging(plain(nugget=1e-6)).fit(x, y[:, :2])
    theta = shared.theta_

    def total(theta):
        return sum(plain(nugget=1e-6, theta=theta).fit(x, t).log_likelihood_ for t in y[:, :2].T)

    assert shared.log_likelihood_ == pytest.approx(total(theta), abs=1e-6)
    for k in range(2):
        for factor in (0.9, 1.1):
            moved = theta.copy()
            moved[k] *= factor
            assert total(moved) < shared.log_likelihood_


def test_shared_predictions_are_those_of_each_response_at_that_theta():
    x, y = runs()
    shared = SharedKriging().fit(x, y)
    new = np.random.default_rng(1).random((6, 3))
    mean, std = shared.predict(new, return_std=True)
    assert shared.predict(new) == pytest.approx(mean)
    for i in range(2):
        alone = plain(theta=shared.theta_).fit(x, y[:, i])
        expected = alone.predict(new, return_std=True)
        assert mean[:, i] == pytest.approx(expected[0], rel=1e-8)
        assert std[:, i] == pytest.approx(expected[1], rel=1e-6)
    assert mean[:, 2] == pytest.approx(2.0)
    assert std[:, 2] == pytest.approx(0.0)
    assert shared.krigings_[0].posterior_.factor.lower is shared.krigings_[1].posterior_.factor.lower


def test_one_response_stays_flat():
    x, y = runs()
    assert SharedKriging().fit(x, y[:, 0]).predict(x).shape == (30,)
    with pytest.raises(ValueError, match=r"y needs shape \(n,\) or \(n, q\)"):
        SharedKriging().fit(x, np.zeros((30, 2, 2)))


def test_trend_is_chosen_by_leave_one_out():
    rng = np.random.default_rng(0)
    x = rng.random((40, 2))
    bend = 5 * (x[:, 0] - 0.3) ** 2 + 3 * x[:, 0] * x[:, 1] + 0.05 * np.sin(20 * x[:, 1])
    for by in ("log_score", "q2"):
        choice = choose_trend(x, bend, by=by, trends=("constant", "quadratic"))
        scores = [getattr(s, by) for s in choice.scores]
        expected = "quadratic" if scores[1] > scores[0] + 0.01 else "constant"
        assert choice.trend == expected == choice.kriging.trend
    assert choose_trend(x, bend).kriging.diagnosis_.q2 > 0.99


def test_a_trend_that_is_exact_is_chosen_and_too_large_ones_are_skipped():
    x = np.random.default_rng(0).random((8, 4))
    choice = choose_trend(x, 1 + x @ [1.0, 2.0, 3.0, 4.0])
    assert choice.trend == "linear"
    assert choice.skipped == ("quadratic",)
    with pytest.raises(TooFewRuns, match="trend 'quadratic' has 15 terms"):
        choose_trend(x, x[:, 0], trends=("quadratic",))
    with pytest.raises(ValueError, match="by needs 'log_score' or 'q2', got 'aic'"):
        choose_trend(x, x[:, 0], by="aic")
    with pytest.raises(ValueError, match="trends needs at least one"):
        choose_trend(x, x[:, 0], trends=())


def test_calibration_of_shared_responses_is_refused():
    x = np.random.default_rng(0).random((12, 2))
    with pytest.raises(ValueError, match="share theta have plug-in intervals, got intervals='calibrated'"):
        SharedKriging(plain(intervals="calibrated")).fit(x, x)
