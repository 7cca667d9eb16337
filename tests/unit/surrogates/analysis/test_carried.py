"""Effects and indices of a response that was modelled on another scale: carried back, they are those of y."""

import numpy as np
import pytest

import doe
from surrogates import Kriging, ScaledKriging, main_effects, sobol_indices
from surrogates.analysis.measure import discrete
from surrogates.analysis.response_map import response_map

RATES = np.array([3.0, -2.0, 0.5])
NEAR = 0.004  # of an index, of a model that misses nothing: what drawn points leave


def product_response(x):
    """exp(r x): of independent inputs all indices are known."""
    return np.exp(x @ RATES)


def exact_indices():
    """Main, total and first interaction of a product: with r_k = Var/mean^2 of its factors."""
    mean = np.expm1(RATES) / RATES
    r = np.expm1(2 * RATES) / (2 * RATES) / mean**2 - 1
    whole = np.prod(1 + r) - 1
    return r / whole, r * np.prod(1 + r) / (1 + r) / whole, r[0] * r[1] / whole


@pytest.fixture(scope="module")
def fitted():
    x = doe.optimised_lhs(30, 3, swaps=5000, rng=np.random.default_rng(3))
    return ScaledKriging(scale="log").fit(x, product_response(x))


def test_indices_of_a_product_of_exponentials(fitted):
    found = sobol_indices(fitted.kriging_, pairs=[(0, 1)], carried=fitted.map_, rng=np.random.default_rng(0))
    main, total, pair = exact_indices()
    assert np.abs(found.main.mean - main).max() < NEAR
    assert np.abs(found.total.mean - total).max() < NEAR
    assert abs(found.interaction.mean[0] - pair) < NEAR
    for exact, band in ((main, found.main), (total, found.total)):
        assert ((band.lower <= exact) & (exact <= band.upper)).all()
    y = product_response(np.random.default_rng(1).random((100_000, 3)))
    assert found.variance.mean() == pytest.approx(y.var(), rel=0.05)


def test_indices_of_the_scale_are_others(fitted):
    of_scale = sobol_indices(fitted.kriging_, rng=np.random.default_rng(0))
    exact = RATES**2 / (RATES**2).sum()
    assert np.abs(of_scale.main.mean - exact).max() < NEAR
    assert abs(of_scale.main.mean[1] - exact_indices()[0][1]) > 10 * NEAR


def test_effects_of_a_product_of_exponentials(fitted):
    found = main_effects(fitted.kriging_, points=5, carried=fitted.map_)
    mean = np.expm1(RATES) / RATES
    for k, effect in enumerate(found):
        exact = np.exp(RATES[k] * effect.x) * np.prod(np.delete(mean, k))
        assert effect.mean == pytest.approx(exact, rel=0.01)
        assert (effect.lower > 0.0).all()
    with pytest.raises(ValueError, match="carried back to the response are not centred"):
        main_effects(fitted.kriging_, centred=True, carried=fitted.map_)
    with pytest.raises(ValueError, match="level needs a probability between 0 and 1, got 2"):
        main_effects(fitted.kriging_, level=2, carried=fitted.map_)


def test_effects_have_a_band_that_noise_widens(fitted):
    rng = np.random.default_rng(5)
    x = doe.lhs(30, 3, rng=rng)
    noisy = ScaledKriging(scale="log").fit(x, product_response(x) * np.exp(0.3 * rng.standard_normal(30)))
    wide = main_effects(noisy.kriging_, inputs=[0], points=3, carried=noisy.map_)[0]
    narrow = main_effects(fitted.kriging_, inputs=[0], points=3, carried=fitted.map_)[0]
    assert (wide.upper - wide.lower > 5 * (narrow.upper - narrow.lower)).all()
    assert ((wide.lower < narrow.mean) & (narrow.mean < wide.upper)).sum() >= 2


def test_a_map_that_is_none_changes_nothing():
    x = doe.lhs(20, 2, rng=np.random.default_rng(0))
    y = x[:, 0] ** 2 + x[:, 1]
    kriging = Kriging().fit(x, y)
    plain = sobol_indices(kriging, rng=np.random.default_rng(0))
    none = sobol_indices(kriging, carried=response_map(y, "none"), rng=np.random.default_rng(0))
    assert (plain.total.mean == none.total.mean).all()
    one, other = main_effects(kriging), main_effects(kriging, carried=response_map(y, "none"))
    assert (one[1].lower == other[1].lower).all()


def test_labels_levels_and_a_single_input():
    rng = np.random.default_rng(2)
    x = np.column_stack([rng.random(40), rng.integers(0, 3, 40), rng.integers(0, 2, 40)])
    y = np.exp(2 * x[:, 0] + 0.8 * x[:, 1])
    model = ScaledKriging(scale="log", kriging=Kriging(categorical=[1])).fit(x, y)
    found = sobol_indices(
        model.kriging_,
        measures=[None, None, discrete([0, 1])],
        pairs=[(0, 1), (1, 2)],
        carried=model.map_,
        rng=rng,
    )
    grid = np.exp(0.8 * np.arange(3))
    r = np.array([np.expm1(4) / 4 / (np.expm1(2) / 2) ** 2 - 1, grid.var() / grid.mean() ** 2])
    assert found.main.mean[:2] == pytest.approx(r / (np.prod(1 + r) - 1), abs=0.03)
    assert found.interaction.mean[0] == pytest.approx(np.prod(r) / (np.prod(1 + r) - 1), abs=0.03)
    assert found.total.mean[2] < 0.01

    alone = ScaledKriging(scale="log").fit(x[:, :1], np.exp(3 * x[:, 0]))
    only = sobol_indices(alone.kriging_, carried=alone.map_, rng=rng)
    assert only.main.mean[0] == pytest.approx(1.0, abs=0.01)
    assert only.total.mean[0] == pytest.approx(1.0, abs=0.01)
    (effect,) = main_effects(alone.kriging_, points=3, carried=alone.map_)
    assert effect.mean == pytest.approx(np.exp(3 * effect.x), rel=0.02)


def test_a_response_that_changes_sign():
    x = doe.lhs(40, 2, rng=np.random.default_rng(7))
    y = np.sinh(4 * (x[:, 0] - 0.5)) ** 3 + x[:, 1]
    model = ScaledKriging(scale="yeo-johnson").fit(x, y)
    found = sobol_indices(model.kriging_, carried=model.map_, rng=np.random.default_rng(0))
    assert found.total.mean[0] > 0.95
    assert found.total.mean.sum() == pytest.approx(1.0, abs=0.03)


def test_the_error_of_left_out_runs_is_one_of_the_response():
    x = doe.lhs(30, 3, rng=np.random.default_rng(1))
    y = product_response(x) + 5.0 * np.random.default_rng(2).random(30)
    model = ScaledKriging(scale="log").fit(x, y)
    left = model.kriging_.leave_one_out()
    error = y - np.exp(left.prediction)
    assert model.q2_ == pytest.approx(1 - (error**2).sum() / ((y - y.mean()) ** 2).sum())
    assert np.isnan(response_map(np.ones(3), "log").q2(np.zeros(3), np.zeros(3)))
