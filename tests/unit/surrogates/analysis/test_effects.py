"""Effects, Sobol' indices and their bands on the six active inputs of Welch's function, known in closed
form."""

import numpy as np
import pytest
from sklearn.exceptions import NotFittedError

from surrogates import (
    accumulated_local_effect,
    main_effects,
    partial_dependence,
    sobol_indices,
)
from surrogates.analysis import measure
from tests.plain_kriging import plain

KINDS = ["gaussian", "power_exponential", "matern32", "matern52", "matern72"]
# mean squares over [-1/2, 1/2]^6 by hand: x12, x4 = x20, x5, x19; then 1:12 and 4:20
TOTAL = 2.514 + 0.263 + 2 * 0.1389 + 0.6944 + 1 / 12 + 0.6548
MAIN = np.array([0, 2.514, 0.1389, 0.1389, 1 / 12, 0.6548]) / TOTAL
PAIRS = np.array([0.263, 0.6944]) / TOTAL


def welch6(x):
    z = x - 0.5
    return (
        5 * z[:, 1] / (1 + z[:, 0]) + 5 * (z[:, 2] - z[:, 3]) ** 2 + z[:, 4] + 40 * z[:, 5] ** 3 - 5 * z[:, 5]
    )


@pytest.fixture(scope="module", params=["gaussian", "matern52"])
def kriging(request):
    x = np.random.default_rng(0).random((80, 6))
    return plain(correlation=request.param, n_starts=3).fit(x, welch6(x))


def small(kind, trend="linear", n=14, seed=0):
    x = np.random.default_rng(seed).random((n, 2))
    return plain(correlation=kind, eta=1.5, trend=trend, n_starts=2).fit(
        x, np.sin(5 * x[:, 0]) + x[:, 0] * x[:, 1]
    )


def test_main_effects_agree_with_the_closed_form(kriging):
    effects = main_effects(kriging, points=11)
    x12 = effects[1]
    exact = 5 * (x12.x - 0.5) * np.log(3) + 5 / 6
    assert np.abs(x12.mean - exact).max() < 0.02 * np.ptp(exact)
    assert np.ptp(effects[0].mean) < 0.05 * np.ptp(x12.mean)  # x1 acts through an interaction only


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("centred", [False, True])
def test_band_of_an_effect_is_that_of_averaged_joint_draws(kind, centred):
    k = small(kind)
    effect = main_effects(k, inputs=[0], points=3, centred=centred)[0]
    grid = (np.arange(15) + 0.5) / 15
    points = np.array([(a, b) for a in [*effect.x, *grid] for b in grid])
    draws = k.sample_posterior(points, 4000, rng=np.random.default_rng(0)).reshape(4000, -1, 15).mean(axis=2)
    curves = draws[:, :3] - (draws[:, 3:].mean(axis=1, keepdims=True) if centred else 0)
    scale = np.abs(curves).max()
    assert effect.mean == pytest.approx(curves.mean(axis=0), abs=0.01 * scale)
    assert effect.std == pytest.approx(curves.std(axis=0), rel=0.1)
    assert (effect.upper - effect.mean) / effect.std == pytest.approx(1.96, abs=0.001)


def test_band_of_an_effect_is_narrower_than_the_band_of_slices():
    k = small("matern52")
    effect = main_effects(k, inputs=[0], points=3)[0]
    slices = [
        k.predict(np.column_stack([np.full(50, v), np.linspace(0, 1, 50)]), return_std=True)[1]
        for v in effect.x
    ]
    assert (effect.std < [s.mean() for s in slices]).all()


def test_sobol_indices_agree_with_the_closed_form(kriging):
    s = sobol_indices(kriging, draws=60, pairs=[(0, 1), (3, 2)], rng=np.random.default_rng(1))
    assert s.main.mean == pytest.approx(MAIN, abs=0.02)
    assert s.total.mean == pytest.approx(
        [PAIRS[0], MAIN[1] + PAIRS[0], MAIN[2] + PAIRS[1], MAIN[3] + PAIRS[1], MAIN[4], MAIN[5]], abs=0.03
    )
    assert s.interaction.mean == pytest.approx(PAIRS, abs=0.02)
    assert s.variance.mean() == pytest.approx(TOTAL, rel=0.05)
    assert ((s.main.lower <= s.main.mean) & (s.main.mean <= s.main.upper)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_sobol_indices_of_draws_equal_sampling_the_draws(kind):
    """Main and total variance against joint posterior draws on a grid."""
    k = small(kind, n=10)
    s = sobol_indices(k, draws=300, features=600, thetas=0, rng=np.random.default_rng(2))
    grid = (np.arange(16) + 0.5) / 16
    points = np.array([(a, b) for a in grid for b in grid])
    draws = k.sample_posterior(points, 300, rng=np.random.default_rng(3)).reshape(300, 16, 16)
    variance = draws.var(axis=(1, 2))
    main = draws.mean(axis=2).var(axis=1) / variance
    total = 1 - draws.mean(axis=1).var(axis=1) / variance
    assert s.main.mean[0] == pytest.approx(main.mean(), abs=0.02)
    assert s.total.mean[0] == pytest.approx(total.mean(), abs=0.02)
    averages = k.predict(points).reshape(16, 16)  # how far the draws lie above the index of the mean path
    shift = main.mean() - averages.mean(axis=1).var() / averages.var()
    width = np.diff(np.quantile(main, [0.025, 0.975]))[0] + abs(shift)
    assert s.main.upper[0] - s.main.lower[0] == pytest.approx(width, rel=0.35, abs=0.01)
    assert s.variance.mean() == pytest.approx(variance.mean(), rel=0.05)


def test_weights_of_the_inputs_change_the_shares():
    x = np.random.default_rng(0).random((40, 2))
    k = plain(n_starts=2).fit(x, x[:, 0] + x[:, 1])
    narrow = measure.uniform(0.4, 0.6)
    s = sobol_indices(k, measures=[None, narrow], rng=np.random.default_rng(0))
    assert s.main.mean == pytest.approx([1 / 1.04, 0.04 / 1.04], abs=1e-3)
    triangle = measure.weighted(0.0, 1.0, [0, 1])  # density 2x: mean 2/3
    assert main_effects(k, inputs=[0], points=2, measures=[None, triangle])[0].mean == pytest.approx(
        [2 / 3, 5 / 3], abs=1e-4
    )


def test_effects_of_labels_and_levels():
    rng = np.random.default_rng(1)
    x = np.column_stack([rng.random(40), rng.integers(0, 3, 40)])
    k = plain(categorical=[1], n_starts=3).fit(x, x[:, 0] + np.array([0.0, 5.0, 1.0])[x[:, 1].astype(int)])
    label = main_effects(k)[1]
    assert label.x.tolist() == [0, 1, 2]
    assert label.mean - label.mean[0] == pytest.approx([0, 5, 1], abs=0.02)
    s = sobol_indices(k, rng=rng)
    variance = np.var([0, 5, 1])
    assert s.main.mean == pytest.approx(
        [1 / 12 / (variance + 1 / 12), variance / (variance + 1 / 12)], abs=0.01
    )


def test_partial_dependence_is_the_mean_of_predictions(kriging):
    x = np.random.default_rng(4).random((60, 6))
    effect = partial_dependence(kriging, x, 1, points=3)
    for value, mean in zip(effect.x, effect.mean, strict=True):
        moved = x.copy()
        moved[:, 1] = value
        assert mean == pytest.approx(kriging.predict(moved).mean(), rel=1e-6)  # weights cancel
        _, covariance = kriging.predict_covariance(moved)
        assert effect.std[effect.x == value][0] ** 2 == pytest.approx(covariance.mean(), rel=1e-3, abs=1e-9)


def test_accumulated_local_effect_of_a_linear_input_is_its_line(kriging):
    x = np.random.default_rng(5).random((100, 6))
    effect = accumulated_local_effect(kriging, x, 4, bins=10)
    slope = np.diff(effect.mean) / np.diff(effect.x)
    assert slope == pytest.approx(1.0, abs=0.3)
    assert ((effect.lower < effect.x - 0.5 + 0.1) & (effect.upper > effect.x - 0.5 - 0.1)).all()


def test_a_constant_response_has_no_effects():
    k = plain().fit(np.random.default_rng(0).random((8, 2)), np.full(8, 3.0))
    s = sobol_indices(k, pairs=[(0, 1)], rng=np.random.default_rng(0))
    assert s.main.mean.tolist() == s.total.mean.tolist() == [0, 0]
    assert main_effects(k, points=2)[0].mean.tolist() == [3, 3]


def test_bad_requests_are_refused():
    k = small("gaussian", trend="constant")
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="draws needs at least 2, got 1"):
        sobol_indices(k, draws=1, rng=rng)
    with pytest.raises(ValueError, match="pairs needs two different inputs"):
        sobol_indices(k, pairs=[(1, 1)], rng=rng)
    with pytest.raises(ValueError, match="pairs needs inputs from 0 to 1, got 9"):
        sobol_indices(k, pairs=[(0, 9)], rng=rng)
    with pytest.raises(ValueError, match="inputs needs inputs from 0 to 1, got 2"):
        main_effects(k, inputs=[2])
    for effect in (accumulated_local_effect, partial_dependence):
        with pytest.raises(ValueError, match="k needs inputs from 0 to 1, got -3"):
            effect(k, rng.random((5, 2)), -3)
    assert sobol_indices(k, draws=2, pairs=[(-1, 0)], rng=rng).pairs == ((1, 0),)
    for ask in (
        lambda raw: sobol_indices(raw, rng=rng),
        main_effects,
        lambda raw: partial_dependence(raw, np.ones((5, 2)), 0),
        lambda raw: accumulated_local_effect(raw, np.ones((5, 2)), 0),
    ):
        with pytest.raises(NotFittedError, match="This Kriging instance is not fitted yet"):
            ask(plain())
    with pytest.raises(ValueError, match="measures needs one entry per input, got 1 for 2"):
        main_effects(k, measures=[None])
    with pytest.raises(ValueError, match="level needs a probability"):
        main_effects(k, level=95)
    with pytest.raises(ValueError, match="never changes in X"):
        accumulated_local_effect(k, np.ones((5, 2)), 0)
    with pytest.raises(ValueError, match="density needs at least two"):
        measure.weighted(0, 1, [1])
    with pytest.raises(ValueError, match="weights needs 2 numbers"):
        measure.discrete([0, 1], [1])
    x = rng.random((10, 2))
    own = plain(trend=np.ones_like).fit(x, x[:, 0])
    with pytest.raises(ValueError, match="effects need a polynomial trend"):
        main_effects(own)
    mixed = plain(categorical=[1]).fit(np.column_stack([x[:, 0], np.arange(10) % 2]), x[:, 0])
    with pytest.raises(ValueError, match="input 1 holds labels"):
        accumulated_local_effect(mixed, mixed.posterior_.u, 1)
