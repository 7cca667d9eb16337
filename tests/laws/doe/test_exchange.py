"""What holds for every exchange design and every D-optimal Latin hypercube."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import doe
from doe.criteria.regression import model_terms

CASES = settings(max_examples=25, deadline=None)
MODELS = st.sampled_from(["linear", "interactions", "quadratic"])


@CASES
@given(d=st.integers(1, 4), extra=st.integers(0, 6), model=MODELS, seed=st.integers(0, 2**32 - 1))
def test_rows_are_distinct_ascending_and_estimate_the_model(d, extra, model, seed):
    rng = np.random.default_rng(seed)
    n = len(model_terms(model, d)) + extra
    candidates = rng.random((3 * n + 5, d))
    rows = doe.exchange(candidates, n, model=model, rng=rng)
    assert (np.diff(rows) > 0).all()
    best = doe.d_efficiency(candidates[rows], model=model)
    assert best >= doe.d_efficiency(candidates[:n], model=model)


@CASES
@given(d=st.integers(1, 3), extra=st.integers(0, 4), seed=st.integers(0, 2**32 - 1))
def test_reflecting_or_swapping_factors_leaves_the_optimum_value(d, extra, seed):
    rng = np.random.default_rng(seed)
    n = len(model_terms("quadratic", d)) + extra
    candidates = rng.random((40, d))
    value = doe.d_efficiency(candidates[doe.exchange(candidates, n, starts=6, rng=rng)], model="quadratic")
    mirrored = 1.0 - candidates[:, ::-1]
    other = doe.d_efficiency(mirrored[doe.exchange(mirrored, n, starts=6, rng=rng)], model="quadratic")
    assert abs(value - other) <= 0.03 * value  # two searches of a few starts


@CASES
@given(n=st.integers(2, 30), d=st.integers(1, 5), seed=st.integers(0, 2**32 - 1))
def test_swaps_inside_columns_keep_a_latin_hypercube_and_its_ceiling(n, d, seed):
    if n < d + 1:
        n = d + 1
    points = doe.d_optimal_within(n, d, swaps=500, rng=np.random.default_rng(seed))
    np.testing.assert_array_equal(np.sort(np.floor(points * n), axis=0), np.tile(np.arange(n)[:, None], d))
    assert doe.d_efficiency(points) <= ((1 - float(n) ** -2) / 3) ** (d / (d + 1)) * (1 + 1e-9)


@CASES
@given(d=st.integers(1, 3), extra=st.integers(0, 5), model=MODELS, seed=st.integers(0, 2**32 - 1))
def test_coordinate_exchange_stays_in_the_cube_and_below_one(d, extra, model, seed):
    n = len(model_terms(model, d)) + extra
    points = doe.coordinate_exchange(n, d, model=model, starts=2, rng=np.random.default_rng(seed))
    assert points.shape == (n, d)
    assert ((points >= 0) & (points <= 1)).all()
    assert 0 < doe.d_efficiency(points, model=model) <= 1 + 1e-9
