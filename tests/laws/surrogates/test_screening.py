"""What holds for every screening: it does not depend on the order or the units of the data, nor on chance."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from surrogates import KrigingScreener

SAME_LIKELIHOOD = 1e-6  # after the known shift (n - 1) log of the factor of y


def data(seed, n=30, d=5):
    rng = np.random.default_rng(seed)
    x = rng.random((n, d))
    w = rng.normal(size=d) * (rng.random(d) < 0.5)
    return x, np.sin(3 * x @ w) + x[:, 0] * x[:, 1] + 0.02 * rng.standard_normal(n)


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_order_of_rows_and_columns_changes_nothing(seed):
    x, y = data(seed)
    rng = np.random.default_rng(seed + 1)
    rows, columns = rng.permutation(30), rng.permutation(5)
    a = KrigingScreener().fit(x, y)
    b = KrigingScreener().fit(x[rows][:, columns], y[rows])
    assert [columns[k] for k in b.selected_] == list(a.selected_)
    assert [columns[k] for k in b.ranking_] == list(a.ranking_)
    # bit for bit: both were screened in the same canonical form
    assert [s.log_likelihood for s in b.path_] == [s.log_likelihood for s in a.path_]


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    factor=st.sampled_from([1e-12, -3.0, 0.1, 1e6, 1e12]),
    widths=st.lists(st.sampled_from([1e-9, 0.5, -2.0, 1e9]), min_size=5, max_size=5),
)
# an input of one percent, in units whose runs fill a small part of the unit cube
@example(seed=7464, factor=1e-12, widths=[1e-9, 1e-9, 0.5, 1e-9, 1e-9])
def test_units_change_the_likelihood_by_the_known_shift_only(seed, factor, widths):
    x, y = data(seed)
    a = KrigingScreener().fit(x, y)
    b = KrigingScreener().fit(x * widths + 3.0 * np.array(widths), factor * y + 2.0 * factor)
    assert list(b.selected_) == list(a.selected_)
    shift = 29 * np.log(abs(factor))
    assert b.log_likelihood_ + shift == pytest.approx(a.log_likelihood_, abs=SAME_LIKELIHOOD)
    np.testing.assert_allclose(b.theta_ * np.square(widths), a.theta_, rtol=1e-4, atol=1e-9)


def test_same_seed_same_result():
    x, y = data(7)
    a, b = KrigingScreener(seed=5).fit(x, y), KrigingScreener(seed=5).fit(x, y)
    assert a.log_likelihood_ == b.log_likelihood_


def test_large_designs_obey_the_same_laws():
    x, y = data(11, n=150)
    columns = np.random.default_rng(0).permutation(5)
    a = KrigingScreener().fit(x, y)
    b = KrigingScreener().fit(x[::-1][:, columns], y[::-1])
    assert [columns[k] for k in b.selected_] == list(a.selected_)
    assert b.log_likelihood_ == a.log_likelihood_


def test_path_never_loses_likelihood_by_a_further_input():
    for seed in range(4):
        x, y = data(seed)
        for method in ("default", "forward"):
            for step in KrigingScreener(method=method).fit(x, y).path_:
                assert step.gain > -1e-2  # a tolerance of the ascents
