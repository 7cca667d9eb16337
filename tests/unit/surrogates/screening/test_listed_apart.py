"""Inputs below one percent of the variance stand beside the list of drivers, not in it."""

import numpy as np
import pytest

from surrogates import KrigingScreener, selected_kriging
from surrogates.analysis.measure import uniform
from surrogates.screening.listed_apart import SelectedShare, at_the_border, minor_inputs

WEAK = 0.11  # slope of an input beside slopes of 1 and 2: 0.24 % of the variance


def data(n=36, d=6, weak=WEAK):
    x = np.random.default_rng(4).random((n, d))
    return x, 2 * x[:, 0] + x[:, 3] ** 2 + weak * x[:, 5]


def shares(*means, width=0.0):
    return [
        SelectedShare(column=k, mean=m, lower=m * (1 - width), upper=m * (1 + width))
        for k, m in enumerate(means)
    ]


def test_a_weak_input_is_seen_and_stands_apart():
    x, y = data()
    screener = KrigingScreener().fit(x, y)
    assert (screener.selected_.tolist(), screener.minor_.tolist()) == ([0, 3], [5])
    facts = screener.diagnosis_
    assert facts.state == "resolved"
    assert "listed apart, estimated below 1.0 % each: 5" in facts.verdict
    (share,) = [s for s in facts.shares if s.column == 5]
    true = WEAK**2 / 12 / (4 / 12 + 4 / 45 + WEAK**2 / 12)
    assert share.lower <= true <= share.upper < 0.01
    # what the list lacks is no more than x says
    assert true <= facts.hidden_share <= 0.01
    assert screener.get_support(indices=True).tolist() == [0, 3]
    assert screener.transform(x).shape == (36, 2)


def test_a_stronger_one_stays_and_a_number_asked_for_is_given():
    x, y = data(weak=0.4)
    assert set(KrigingScreener().fit(x, y).selected_) == {0, 3, 5}
    x, y = data()
    screener = KrigingScreener(n_features=3).fit(x, y)
    assert set(screener.selected_) == {0, 3, 5}
    assert len(screener.minor_) == 0


def test_what_lies_at_the_border_of_one_percent_keeps_a_screening_from_being_resolved():
    # slopes such that input 5 has 1 % of the variance: its band holds the border
    x = np.random.default_rng(4).random((36, 6))
    noise = 0.02 * np.random.default_rng(5).standard_normal(36)
    weak = (0.01 / 0.99 * (4 / 12 + 4 / 45) * 12) ** 0.5
    screener = KrigingScreener().fit(x, 2 * x[:, 0] + x[:, 3] ** 2 + weak * x[:, 5] + noise)
    facts = screener.diagnosis_
    assert facts.border == (5,)
    assert facts.state == "partly resolved"
    assert "5 lies at the border of 1.0 %: listed, or listed apart, by chance" in facts.verdict
    assert facts.advice == "keep 5 or not: about 1.0 % of the variance"
    assert {5} == {*screener.selected_, *screener.minor_} - {0, 3}
    clear = KrigingScreener().fit(x, 2 * x[:, 0] + x[:, 3] ** 2 + 2 * weak * x[:, 5] + noise)
    assert (clear.diagnosis_.border, set(clear.selected_)) == ((), {0, 3, 5})


def test_the_border_is_a_standard_deviation_wide():
    for mean, is_border in ((0.0089, False), (0.0092, True), (0.0109, True), (0.0113, False)):
        assert bool(at_the_border(shares(mean, width=0.2))) == is_border


def test_of_inputs_that_stand_together_the_sum_counts():
    two = shares(0.0095, 0.010, width=0.2)
    assert at_the_border(two) == (0, 1)
    assert at_the_border(two, [(0, 1)]) == ()
    assert at_the_border(shares(0.005, 0.005, width=0.2), [(0, 1)]) == (0, 1)


def test_shares_are_averaged_over_the_measures_given():
    x, y = data()
    narrow = [uniform(0.4, 0.6)] * 5 + [uniform()]
    # with the strong inputs in a fifth of their ranges the weak one has 25 times its share
    assert set(KrigingScreener(measures=narrow).fit(x, y).selected_) == {0, 3, 5}


@pytest.mark.parametrize("factor", [1e-9, 0.37, 1e6])
def test_shares_do_not_depend_on_units(factor):
    x, y = data()
    plain, scaled = KrigingScreener().fit(x, y), KrigingScreener().fit(factor * x, y)
    for one, other in zip(plain.diagnosis_.shares, scaled.diagnosis_.shares, strict=True):
        assert (other.mean, other.upper) == pytest.approx((one.mean, one.upper), rel=1e-4)


def test_units_do_not_matter():
    x, y = data()
    width = np.array([1e9, 1.0, 1e-9, 1e9, 1.0, 1e9])
    screener = KrigingScreener().fit(x * width, 1e-12 * y)
    assert (screener.selected_.tolist(), screener.minor_.tolist()) == ([0, 3], [5])


@pytest.mark.slow
def test_the_kriging_takes_them_when_asked():
    x, y = data()
    screener = KrigingScreener().fit(x, y)
    without, with_it = (selected_kriging(screener, x, y, minor=minor) for minor in (False, True))
    assert (without.n_features_in_, with_it.n_features_in_) == (2, 3)
    new = np.random.default_rng(1).random((200, 6))
    true = 2 * new[:, 0] + new[:, 3] ** 2 + WEAK * new[:, 5]
    error = [
        np.mean((model.predict(screener.columns(new, columns)) - true) ** 2)
        for model, columns in ((without, [0, 3]), (with_it, [0, 3, 5]))
    ]
    assert error[1] < 0.1 * error[0]


@pytest.mark.parametrize("resolved", [True, False])
def test_a_band_that_reaches_one_percent_counts_where_the_model_is_in_doubt(resolved):
    assert minor_inputs(shares(0.9, 0.008, width=0.5), resolved=resolved) == ((1,) if resolved else ())


def test_many_weak_inputs_stay_together():
    found = minor_inputs(shares(0.5, *[0.009] * 9), resolved=True)
    assert len(found) == 5  # a twentieth at most
    assert minor_inputs(shares(*[0.008] * 5), resolved=True) == ()  # a model of noise has no shares


def test_groups_stay_together():
    all_of_them = shares(0.9, 0.006, 0.006, 0.003)
    assert minor_inputs(all_of_them, [(1, 2)], resolved=True) == (3,)
    assert set(minor_inputs(all_of_them, [(1, 3)], resolved=True)) == {1, 2, 3}
