"""The runs choose correlation and trend: what is chosen, what it rests on, and that it may be named."""

import numpy as np
import pytest

from surrogates import Kriging, NotPositiveDefinite
from tests.plain_kriging import plain


def cube(n, d, seed=0):
    return np.random.default_rng(seed).random((n, d))


def smooth(x):
    return np.sin(4 * x[:, 0]) + x[:, 1] * x[:, 2]


def kinked(x):
    return np.abs(x[:, 0] - 0.4) + np.maximum(x[:, 1] + x[:, 2] - 1.0, 0.0)


def test_smooth_responses_are_gaussian_and_kinked_ones_are_not():
    x = cube(40, 3)
    assert Kriging(intervals="plug-in").fit(x, smooth(x)).correlation_ == "gaussian"
    k = Kriging(intervals="plug-in").fit(x, kinked(x))
    assert k.correlation_ == "matern52"
    gaussian, rough, between = k.forms_[:3]
    assert (gaussian.correlation, rough.correlation, between.correlation) == (
        "gaussian",
        "matern52",
        "matern72",
    )
    assert rough.log_likelihood > max(gaussian.log_likelihood - 1.0, between.log_likelihood)


def test_what_is_smooth_and_not_analytic_is_matern_of_seven_halves():
    x = cube(25, 2, seed=4)
    branin = (
        15 * x[:, 1] - 5.1 / (4 * np.pi**2) * (15 * x[:, 0] - 5) ** 2 + (15 * x[:, 0] - 5) * 5 / np.pi - 6
    ) ** 2
    branin += 10 * (1 - 1 / (8 * np.pi)) * np.cos(15 * x[:, 0] - 5) + 10
    k = Kriging(intervals="plug-in", trend="constant").fit(x, branin)
    assert k.correlation_ == "matern72"
    gaussian, rough, between = (f.log_likelihood for f in k.forms_)
    assert between > max(gaussian - 1.0, rough)


def test_a_slope_over_the_box_is_a_linear_trend():
    x = cube(40, 3)
    steep = 30.0 * x[:, 0] + 20.0 * x[:, 1] + np.sin(9 * x[:, 2])
    k = Kriging(intervals="plug-in").fit(x, steep)
    assert k.trend_ == "linear"
    assert k.forms_[3].log_score > max(f.log_score for f in k.forms_[:3]) + 0.3
    assert len(k.beta_) == 4
    assert Kriging(intervals="plug-in").fit(x[:7], steep[:7]).trend_ == "constant"  # eight runs would do


def test_the_chosen_model_is_that_of_the_named_form():
    x = cube(40, 3, seed=1)
    chosen = Kriging(intervals="plug-in").fit(x, kinked(x))
    named = plain(correlation=chosen.correlation_, trend=chosen.trend_, theta_start=chosen.theta_, n_starts=1)
    named.fit(x, kinked(x))
    assert named.log_likelihood_ == pytest.approx(chosen.log_likelihood_, abs=1e-6)
    new = cube(20, 3, seed=2)
    assert named.predict(new) == pytest.approx(chosen.predict(new), abs=1e-4)
    assert named.forms_ == ()


@pytest.mark.parametrize(
    ("settings", "tried"),
    [
        ({"correlation": "matern32"}, [("matern32", "constant"), ("matern32", "linear")]),
        ({"trend": "linear"}, [("gaussian", "linear"), ("matern52", "linear"), ("matern72", "linear")]),
        ({"correlation": "gaussian", "trend": "constant"}, []),
        ({"theta": 2.0}, []),
    ],
)
def test_only_what_is_left_open_is_tried(settings, tried):
    x = cube(30, 3)
    k = Kriging(intervals="plug-in", **settings).fit(x, smooth(x))
    assert [(f.correlation, f.trend) for f in k.forms_] == tried
    if "theta" in settings:
        assert (k.correlation_, k.trend_) == ("gaussian", "constant")


def test_many_runs_are_chosen_for_by_some_of_them_in_any_order():
    x = cube(252, 2)
    order = np.random.default_rng(5).permutation(252)
    y = np.sin(5 * x[:, 0]) * x[:, 1]
    one = Kriging(intervals="plug-in").fit(x, y, noise=np.full(252, 1e-6))
    two = Kriging(intervals="plug-in").fit(x[order], y[order], noise=np.full(252, 1e-6))
    assert one.correlation_ == two.correlation_
    assert [f.log_score for f in one.forms_] == pytest.approx([f.log_score for f in two.forms_], abs=1e-3)
    assert one.posterior_.u.shape == (252, 2)


def test_intervals_above_three_hundred_runs_rest_on_leave_one_out():
    x = cube(310, 2)
    y = smooth(np.column_stack([x, x[:, 0]])) + 0.1 * np.random.default_rng(3).normal(size=310)
    bare = plain(nugget="estimate").fit(x, y)
    k = plain(nugget="estimate", intervals="calibrated").fit(x, y)
    errors = np.sort(np.abs(bare.leave_one_out().standardised))
    assert k.interval_factor_ == pytest.approx(errors[int(np.ceil(0.95 * 311)) - 1] / 1.959964, rel=1e-6)
    assert k.diagnosis_.coverage95 == pytest.approx(0.95, abs=0.01)


def test_a_form_chosen_by_the_runs_has_its_factor_drawn_towards_the_usual_one():
    x = cube(30, 3, seed=3)
    y = kinked(x)
    chosen = Kriging().fit(x, y)
    named = plain(
        correlation=chosen.correlation_,
        trend=chosen.trend_,
        theta_start=chosen.theta_,
        intervals="calibrated",
        n_starts=1,
    ).fit(x, y)
    expected = named.interval_factor_ ** (30 / 50) * 1.45 ** (20 / 50)
    assert chosen.interval_factor_ == pytest.approx(expected, rel=1e-3)


def test_a_constant_response_and_an_exact_plane():
    x = cube(20, 2)
    flat = Kriging().fit(x, np.full(20, 3.0))
    assert flat.trend_ == "constant"
    assert flat.predict(x) == pytest.approx(3.0)
    plane = Kriging().fit(x, 1.0 + 2.0 * x[:, 0] - x[:, 1])
    assert plane.trend_ == "linear"
    assert plane.beta_ == pytest.approx([1.0, 2.0, -1.0])


def test_when_no_form_can_be_fitted_the_error_is_that_of_the_last():
    x = np.concatenate([cube(20, 2), cube(20, 2)[:3]])
    with pytest.raises(NotPositiveDefinite, match=r"runs . and .* apart"):
        Kriging(nugget=0.0).fit(x, x[:, 0])
