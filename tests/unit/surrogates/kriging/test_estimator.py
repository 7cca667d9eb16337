"""Kriging does its job: likelihood, prediction, leave-one-out, estimator contract."""

import numpy as np
import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from surrogates import Kriging
from tests.plain_kriging import plain

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


@pytest.mark.slow
@parametrize_with_checks([plain(n_starts=2), Kriging(n_starts=2)])
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.mark.parametrize("trend", ["constant", "linear"])
@pytest.mark.parametrize("criterion", ["reml", "ml"])
def test_likelihood_is_the_dense_formula_in_the_coordinates_of_x(trend, criterion):
    x, y = runs()
    x = 3.0 + 5.0 * x
    k = plain(criterion=criterion, trend=trend, nugget=1e-6).fit(x, y)
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


def test_posterior_predicts_new_runs():
    x, y = runs(60)
    new, truth = runs(500, seed=9)
    mean, std = plain().fit(x, y).predict(new, return_std=True)
    assert 1 - ((mean - truth) ** 2).mean() / truth.var() > 0.999
    assert 0.85 < np.mean(np.abs(mean - truth) < 1.96 * std) <= 1


def test_dropping_the_trend_term_would_be_seen():
    """Far from the runs the variance exceeds sigma^2 by what estimating the trend costs."""
    x, y = runs()
    k = plain(theta=[50.0] * 3, nugget=1e-6).fit(x, y)
    f = np.ones((len(x), 1))
    r, _, _ = dense(x, y, f, k.theta_)
    expected = k.sigma2_ * (1 + 1 / np.linalg.inv(r).sum())
    assert k.predict([[9.0, 9.0, 9.0]], return_std=True)[1][0] ** 2 == pytest.approx(expected, rel=1e-6)


def test_warm_start_and_fixed_theta():
    x, y = runs()
    best = plain(n_starts=8).fit(x, y)
    warm = plain(n_starts=1, theta_start=best.theta_).fit(x, y)
    assert warm.log_likelihood_ == pytest.approx(best.log_likelihood_, abs=1e-6)
    assert warm.diagnosis_.evaluations <= best.diagnosis_.evaluations / 3
    fixed = plain(theta=best.theta_).fit(x, y)
    assert fixed.log_likelihood_ == pytest.approx(best.log_likelihood_, abs=1e-9)
    assert fixed.diagnosis_.evaluations == 0


def test_bounds_are_kept_and_reported():
    x, y = runs()
    k = plain(theta_bounds=(0.5, 1.0)).fit(x, y)
    assert ((k.theta_ >= 0.5 - 1e-9) & (k.theta_ <= 1.0 + 1e-9)).all()
    assert k.diagnosis_.at_upper_bound + k.diagnosis_.at_lower_bound != ()


def test_a_prior_keeps_theta_near_its_median_where_the_runs_say_little():
    x, y = runs(8, 5)
    free = np.log(plain().fit(x, y).theta_)
    held = np.log(plain(theta_prior=(2.0, 1.0)).fit(x, y).theta_)
    assert np.ptp(free) > 5.0  # some inputs look inert, or cut off
    assert np.abs(held - np.log(2.0)).max() < 2.5
    wide = plain(theta_prior=(2.0, 1e4)).fit(x, y)
    assert wide.log_likelihood_ == pytest.approx(plain().fit(x, y).log_likelihood_, abs=1e-4)


def test_groups_share_one_theta():
    x, y = runs(30, 4)
    k = plain(groups=["a", "b", "b", "a"]).fit(x * [1, 1, 1, 1], y)
    u = k.posterior_.theta
    assert u[0] == u[3]
    assert u[1] == u[2] != u[0]


def test_free_exponent_finds_a_rough_process():
    rng = np.random.default_rng(0)
    x = np.sort(rng.random((60, 1)), axis=0)
    exponential = np.exp(-8 * np.abs(x - x.T))
    y = np.linalg.cholesky(exponential) @ rng.normal(size=60)
    k = plain(correlation="power_exponential").fit(x, y)
    assert 1.0 <= k.eta_ < 1.5
    assert k.log_likelihood_ >= plain(correlation="power_exponential", eta=1.9).fit(x, y).log_likelihood_
    smooth = plain(correlation="power_exponential").fit(x, np.sin(6 * x[:, 0]))
    assert smooth.eta_ > 1.9


@pytest.mark.parametrize("nugget", ["estimate", "ladder"])
def test_unknown_noise_is_found(nugget):
    rng = np.random.default_rng(1)
    x, y = runs(120, 2 + 1)
    noisy = y + 0.1 * rng.normal(size=120)
    k = plain(nugget=nugget).fit(x, noisy)
    level = np.sqrt(k.nugget_ * k.sigma2_)
    assert 0.05 < level < 0.2  # the ladder has a rung per factor of ten in sd
    new, truth = runs(300, seed=5)
    silent = plain(nugget=1e-8).fit(x, noisy)
    assert np.mean((k.predict(new) - truth) ** 2) < 0.7 * np.mean((silent.predict(new) - truth) ** 2)
    assert k.diagnosis_.nugget_estimated


def test_known_noise_weighs_the_runs():
    x, y = runs(40)
    noise = np.where(np.arange(40) < 20, 1e-8, 0.25)
    wrong = y + np.where(np.arange(40) < 20, 0.0, 0.5 * np.random.default_rng(0).normal(size=40))
    k = plain(nugget=0.0).fit(x, wrong, noise=noise)
    assert np.abs(k.predict(x[:20]) - y[:20]).max() < 1e-3
    assert k.leave_one_out().coverage95 > 0.8
    # constant noise is a nugget: the same optimum in two parametrisations
    one = plain(nugget="estimate", n_starts=8).fit(x, wrong)
    two = plain(nugget=0.0, n_starts=8).fit(x, wrong, noise=one.nugget_ * one.sigma2_)
    assert two.log_likelihood_ == pytest.approx(one.log_likelihood_, abs=0.01)


def test_replicates_free_the_nugget_and_are_named():
    x, y = runs(30)
    x2, y2 = np.concatenate([x, x[:10]]), np.concatenate([y, y[:10] + 0.05])
    k = plain().fit(x2, y2, run_ids=[f"r{i}" for i in range(40)])
    assert k.diagnosis_.nugget_estimated
    assert ("r3", "r33") in k.diagnosis_.unequal_duplicates
    equal = plain().fit(np.concatenate([x, x[:2]]), np.concatenate([y, y[:2]]))
    assert equal.diagnosis_.duplicates == ((0, 30), (1, 31))
    assert equal.nugget_ == 1e-8


def test_labels_as_numbers_and_as_strings_give_the_same_model():
    rng = np.random.default_rng(0)
    kinds = rng.integers(0, 3, 40)
    number = rng.random(40)
    y = np.sin(4 * number) * np.array([1.0, -1.0, 0.5])[kinds]
    coded = np.column_stack([number, kinds])
    named = np.column_stack([number.astype(object), np.array(["steel", "foam", "wood"], dtype=object)[kinds]])
    one, two = (plain(categorical=[1]).fit(t, y) for t in (coded, named))
    assert one.log_likelihood_ == pytest.approx(two.log_likelihood_, abs=1e-9)
    new = np.array([[0.3, "foam"], [0.3, "steel"], [0.3, "never seen"]], dtype=object)
    mean, std = two.predict(new, return_std=True)
    assert mean[:2] == pytest.approx([-np.sin(1.2), np.sin(1.2)], abs=0.05)
    assert std[2] > 5 * std[:2].max()
    relabelled = np.column_stack([number, np.array([7.0, -3.0, 100.0])[kinds]])
    assert plain(categorical=[1]).fit(relabelled, y).log_likelihood_ == pytest.approx(
        one.log_likelihood_, abs=1e-9
    )


def test_trend_terms_that_the_runs_cannot_tell_apart_are_left_out():
    x, y = runs(30)
    x = np.column_stack([x, np.ones(30), x[:, 0] > 0.5])
    k = plain(trend="quadratic").fit(x, y)
    assert "x3" in k.diagnosis_.dropped_trend_terms
    assert "x4^2" in k.diagnosis_.dropped_trend_terms
    assert k.diagnosis_.constant_inputs == (3,)


def test_more_than_250_runs_climb_on_a_subsample():
    x, y = runs(300, 5)
    k = plain(n_starts=3).fit(x, y)
    assert k.diagnosis_.q2 > 0.999
    assert k.diagnosis_.converged
    again = plain(theta_start=k.theta_, n_starts=1).fit(x, y)
    assert again.log_likelihood_ - k.log_likelihood_ < 0.1


def test_calibration_scales_every_band_by_one_factor():
    x, y = runs(30)
    bare = plain(n_starts=2).fit(x, y)
    wide = plain(n_starts=2, intervals="calibrated").fit(x, y)
    assert wide.interval_factor_ == wide.diagnosis_.interval_factor != 1
    assert wide.leave_one_out().std / bare.leave_one_out().std == pytest.approx(wide.interval_factor_)
    new = x[:4] + 0.03
    (m1, s1), (m2, s2) = bare.predict(new, return_std=True), wide.predict(new, return_std=True)
    assert m2.tolist() == m1.tolist()
    run = np.sqrt(s1**2 + bare.nugget_ * bare.sigma2_)  # a new run scatters by the nugget more
    assert s2 / run == pytest.approx(wide.interval_factor_)
    assert wide.predict_covariance(new)[1] == pytest.approx(
        wide.interval_factor_**2 * bare.predict_covariance(new)[1]
    )
    assert wide.sigma2_ == bare.sigma2_
    rows = np.random.default_rng(0).permutation(30)
    again = plain(n_starts=2, intervals="calibrated").fit(x[rows], y[rows])
    assert again.interval_factor_ == pytest.approx(wide.interval_factor_, rel=1e-3)
    assert plain(intervals="calibrated").fit(x[:8], y[:8]).interval_factor_ == 1.0
    noisy = plain(intervals="calibrated", n_starts=2).fit(x, y, noise=np.full(30, 0.01))
    assert noisy.interval_factor_ > 0


def test_works_in_a_pipeline_and_with_partial_dependence_display():
    from sklearn.inspection import PartialDependenceDisplay
    from sklearn.model_selection import cross_val_score
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    x, y = runs(40)
    model = make_pipeline(StandardScaler(), plain(n_starts=2))
    assert cross_val_score(model, x, y, cv=4).min() > 0.95
    k = plain(n_starts=2).fit(x, y)
    display = PartialDependenceDisplay.from_estimator(k, x, [0, (0, 1)], grid_resolution=5)
    assert display.axes_.size == 2


@pytest.mark.parametrize(("kind", "power"), [("gaussian", 2.0), ("power_exponential", 1.5)])
def test_theta_is_in_the_coordinates_of_x(kind, power):
    x, y = runs()
    x = x * [1.0, 10.0, 0.1] + 4.0
    k = plain(correlation=kind, eta=1.5, nugget=1e-6).fit(x, y)
    r = np.exp(-(k.theta_ * np.abs(x[:, None] - x[None]) ** power).sum(-1)) + 1e-6 * np.eye(len(x))
    inverse = np.linalg.inv(r)
    m = len(y) - 1
    beta = inverse.sum(axis=0) @ y / inverse.sum()
    sigma2 = (y - beta) @ inverse @ (y - beta) / m
    twice = -m * np.log(sigma2) - np.linalg.slogdet(r)[1] - np.log(inverse.sum()) - m
    assert k.sigma2_ == pytest.approx(sigma2, rel=1e-6)
    assert k.log_likelihood_ == pytest.approx(0.5 * twice, rel=1e-7)
