"""Maps of a response: the definitions, the way back, the power, what is refused."""

import numpy as np
import pytest
from scipy import stats

from surrogates import RESPONSE_SCALES, response_map

Y = np.exp(np.random.default_rng(0).normal(1.0, 0.8, 60))


@pytest.mark.parametrize("scale", RESPONSE_SCALES)
def test_there_and_back(scale):
    found = response_map(Y, scale)
    assert found.inverse(found.forward(Y)) == pytest.approx(Y, rel=1e-9)
    grid = np.linspace(Y.min(), Y.max(), 200)
    assert (np.diff(found.forward(grid)) >= 0.0).all()
    assert scale in found.words


def test_powers_are_those_of_scipy():
    found = response_map(Y, "box-cox")
    assert found.power == pytest.approx(stats.boxcox_normmax(Y, method="mle"), abs=1e-3)
    assert found.forward(Y) == pytest.approx(stats.boxcox(Y / stats.gmean(Y), lmbda=found.power), abs=1e-9)
    signed = Y - 3.0
    found = response_map(signed, "yeo-johnson")
    t = (signed - found.centre) / found.unit
    assert found.power == pytest.approx(stats.yeojohnson_normmax(t), abs=1e-3)
    assert found.forward(signed) == pytest.approx(stats.yeojohnson(t, lmbda=found.power), abs=1e-9)


@pytest.mark.parametrize("scale", ["box-cox", "yeo-johnson"])
def test_other_units_give_the_same_scale(scale):
    one, two = response_map(Y, scale), response_map(1e6 * Y, scale)
    assert one.power == pytest.approx(two.power, abs=1e-4)
    assert one.forward(Y) == pytest.approx(two.forward(1e6 * Y), abs=1e-3)


@pytest.mark.parametrize("scale", ["log", "box-cox", "yeo-johnson", "ranks"])
def test_the_way_back_is_held_beyond_the_runs(scale):
    found = response_map(Y, scale)
    far = found.inverse([-1e9, 1e9])
    assert np.isfinite(far).all()
    if scale == "yeo-johnson":
        reach = 3.0 * np.ptp(Y)
        assert far == pytest.approx([Y.min() - reach, Y.max() + reach])
    elif scale != "ranks":
        assert far == pytest.approx([Y.min() * np.exp(-3), Y.max() * np.exp(3)])
    else:
        assert far == pytest.approx([Y.min(), Y.max()])


def test_equal_values_and_a_constant():
    twice = response_map([1.0, 2.0, 2.0, 5.0], "ranks")
    assert twice.forward([2.0, 5.0]).tolist() == [2.5, 4.0]
    assert twice.inverse([2.5]).tolist() == [2.0]
    assert response_map(np.full(5, 3.0), "box-cox").power == 1.0
    assert response_map(np.full(5, 3.0), "yeo-johnson").forward([3.0]) == pytest.approx([0.0])


def test_what_is_refused():
    with pytest.raises(ValueError, match="scale needs one of none, log, ranks, box-cox, yeo-johnson, got"):
        response_map(Y, "x")
    with pytest.raises(ValueError, match="the logarithm needs responses above 0, got -1: take 'ranks' or"):
        response_map([-1.0, 2.0], "log")
    with pytest.raises(ValueError, match="box-cox needs responses above 0, got -1: take 'ranks' or"):
        response_map([-1.0, 2.0], "box-cox")
