"""The Kriging behind a search: which transform it takes, what it counts as a gain, and what caution means."""

import numpy as np
import pytest

import doe
from studies.worst_case_gallery import goldstein_price
from workbench.search.runs.noticeable_gain import accuracy_scale, noticeable_gain
from workbench.search.surrogate.fitting import fit_local_model, fit_search_model


def points(n, d, seed=0):
    return np.random.default_rng(seed).random((n, d))


def test_a_gain_is_a_share_of_the_spread_or_of_the_value_whichever_is_less():
    assert accuracy_scale(np.array([0.0, 0.0, 1000.0])) == 1000.0
    assert accuracy_scale(np.array([-1000.0, -900.0, -2.0])) == 2.0
    assert noticeable_gain(np.array([-1000.0, -900.0, -2.0])) == pytest.approx(6e-3)
    assert (
        0 < accuracy_scale(np.array([-1000.0, -900.0, 0.0])) < 1
    )  # a value of zero asks for no infinite accuracy
    assert noticeable_gain(np.ones(4)) == 0.0


def test_a_response_over_five_decades_is_searched_on_its_logarithm():
    u = points(24, 2)
    v = -np.array([goldstein_price(x1=4 * a - 2, x2=4 * b - 2) for a, b in u])
    model = fit_search_model(u, v, previous=None, seed=0)
    assert model.transform.is_towards_max
    assert model.cautious is not None
    assert model.cautious.transform == model.transform


def test_a_smooth_response_of_one_scale_is_left_as_it_is():
    u = points(24, 2)
    v = np.sin(3 * u[:, 0]) + u[:, 1]
    assert fit_search_model(u, v, previous=None, seed=0).transform.kind == "identity"


def test_a_logarithm_is_given_up_when_a_value_of_the_other_sign_appears():
    u = points(26, 2)
    v = -np.exp(8 * u[:, 0] - 6 * u[:, 1])
    before = fit_search_model(u[:25], v[:25], previous=None, seed=0)
    assert before.transform.is_anchored_at_zero
    v[25] = 3.0
    after = fit_search_model(u, v, previous=before, seed=0)
    assert not after.transform.is_anchored_at_zero
    assert after.chosen_at == 26


def test_the_cautious_model_takes_no_input_for_inert():
    u = points(20, 3)
    model = fit_search_model(u, np.sin(6 * u[:, 0]), previous=None, seed=0)
    assert model.cautious is not None
    theta, cautious = model.kriging.theta_, model.cautious.kriging.theta_
    assert theta.min() < 0.05 * theta.mean()  # below the floor of a tenth
    assert cautious.min() >= 0.09 * cautious.mean()  # a tenth of the mean before the floor raised it


def test_few_runs_take_a_linear_trend_where_left_out_runs_are_predicted_and_none_where_not():
    u = doe.optimised_lhs(8, 4, criterion="phi_p", swaps=2000, rng=np.random.default_rng(2))
    slope = u @ np.array([3.0, -2.0, 1.0, 0.5])
    assert fit_search_model(u, slope + 0.2 * slope**2, previous=None, seed=0).trend == "linear"
    peak = np.exp(-8 * ((u - 0.4) ** 2).sum(axis=1))
    assert fit_search_model(u, peak, previous=None, seed=0).trend == "constant"


@pytest.mark.parametrize("seed", [4, 6, 10])
def test_a_linear_trend_goes_as_soon_as_left_out_runs_speak_against_it(seed):
    u = points(7, 3, seed=seed)
    peak = np.exp(-((u - [0.3, 0.6, 0.8]) ** 2).sum(axis=1) / 0.15)
    model = fit_search_model(u, peak, previous=None, seed=0)
    assert model.trend == "constant"
    assert model.q2 > 0.0  # with the trend below -0.1


def test_few_runs_do_not_make_an_input_inert():
    u = points(9, 6, seed=4)
    model = fit_search_model(u, np.exp(-8 * ((u - 0.4) ** 2).sum(axis=1)), previous=None, seed=0)
    theta = model.kriging.theta_
    assert theta.min() > 0.02 * theta.max()


def test_a_local_model_is_one_of_the_nearest_runs():
    u = points(60, 2, seed=5)
    v = np.sin(20 * u[:, 0]) * (u[:, 0] > 0.5)
    centre = np.array([0.1, 0.5])
    local = fit_local_model(u, v, centre, seed=0)
    near = np.argsort(((u - centre) ** 2).sum(axis=1))[: local.n_runs]
    assert local.n_runs == 10
    np.testing.assert_allclose(local.mean(u[near]), v[near], atol=1e-5)


def test_a_linear_response_keeps_its_linear_trend_however_many_runs_there_are():
    """An exact fit leaves no deviations of left-out runs: it once lost to a constant for that."""
    slopes = np.array([1.0, -2.0, 0.5, 0.3])
    for n in (9, 20):
        u = points(n, 4, seed=n)
        model = fit_search_model(u, u @ slopes, previous=None, seed=0)
        assert model.trend == "linear"
        corner = np.array([[1.0, 0.0, 1.0, 1.0]])
        assert model.mean(corner)[0] == pytest.approx(1.8, abs=1e-9)
