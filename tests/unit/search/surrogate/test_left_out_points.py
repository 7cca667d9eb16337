"""Q2 over points: all runs of a point are left out together."""

import numpy as np
import pytest

from surrogates import Kriging
from workbench.search.surrogate.left_out_points import q2_of_points
from workbench.search.surrogate.noisy import credible_noisy_models, fit_noisy_model


def test_it_is_what_refits_without_each_point_give():
    rng = np.random.default_rng(0)
    sites = rng.random((12, 2))
    u = np.vstack([sites, sites[:1], sites[:1], sites[3:4]])
    v = np.sin(4 * u[:, 0]) + u[:, 1] + 0.2 * rng.standard_normal(len(u))
    model = fit_noisy_model(u, v, previous=None, seed=0)
    means, errors = [], []
    for site in sites:
        mine = (u == site).all(axis=1)
        refit = Kriging(
            trend=model.trend,
            correlation=model.correlation,
            theta=model.kriging.theta_,
            nugget=model.kriging.nugget_,
            intervals="plug-in",
        ).fit(u[~mine], v[~mine])
        means.append(v[mine].mean())
        errors.append(means[-1] - float(refit.predict(site[None])[0]))
    expected = 1 - np.sum(np.square(errors)) / np.sum((np.array(means) - np.mean(means)) ** 2)
    assert q2_of_points(model, u, v) == pytest.approx(expected, abs=1e-6)


def test_repeats_of_one_point_explain_nothing_of_the_others():
    """A narrow peak with many runs: left out one by one its twins predict it, and all looks explained."""
    rng = np.random.default_rng(1)
    u = np.vstack([rng.random((25, 3)), np.full((12, 3), 0.5)])
    v = 0.3 * rng.standard_normal(37) + np.where((u == 0.5).all(axis=1), 2.0, 0.0)
    models, _ = credible_noisy_models(u, v, seed=0)
    assert max(model.q2 for model in models) > 0.5
    assert max(q2_of_points(model, u, v) for model in models) < 0.1


def test_the_bound_is_drawn_from_rough_models_alone():
    rng = np.random.default_rng(2)
    u = rng.random((30, 2))
    models, shares = credible_noisy_models(u, u.sum(axis=1) + 0.1 * rng.standard_normal(30), seed=0)
    assert {(model.correlation, model.trend) for model in models} == {("matern32", "linear")}
    assert shares.sum() == pytest.approx(1.0)
