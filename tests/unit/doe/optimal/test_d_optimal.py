"""The three readings of a D-optimality-selected Latin hypercube."""

import numpy as np
import pytest

import doe
from doe.criteria.regression import factor_lists, model_matrix, model_terms
from doe.optimal import _kernels_within as kernels

# rank-four updates against a fresh factorisation after 1e5 swaps
AFTER_SWAPS = 1e-10


def is_latin(points):
    n = len(points)
    return (np.sort(np.floor(points * n), axis=0) == np.arange(n)[:, None]).all()


def test_selected_points_come_from_one_pool_and_gain_determinant():
    rng = np.random.default_rng(1)
    points = doe.d_optimal_select(20, 4, pool=200, rng=rng)
    np.testing.assert_allclose(points * 199, np.rint(points * 199), atol=1e-9)
    random = doe.d_optimal_best_of(20, 4, tries=200, rng=rng)
    within = doe.d_optimal_within(20, 4, swaps=20_000, rng=rng)
    assert doe.d_efficiency(points) > doe.d_efficiency(within) > doe.d_efficiency(random)
    assert is_latin(within)
    assert is_latin(random)


def test_linear_swaps_reach_the_ceiling_of_a_latin_hypercube():
    points = doe.d_optimal_within(50, 20, rng=np.random.default_rng(2))
    ceiling = ((1 - 50.0**-2) / 3) ** (20 / 21)
    assert 0.9998 * ceiling < doe.d_efficiency(points) <= ceiling


def test_columns_with_given_levels_keep_them():
    rng = np.random.default_rng(5)
    start = np.column_stack([np.repeat([0.0, 0.5, 1.0], 5), rng.random(15), np.tile([0.0, 1.0, 1.0], 5)])
    points = doe.d_optimal_within(15, 3, start=start, swaps=3000, rng=rng)
    np.testing.assert_array_equal(np.sort(points, axis=0), np.sort(start, axis=0))
    assert doe.d_efficiency(points) > doe.d_efficiency(rng.permuted(start, axis=0))


@pytest.mark.parametrize("model", ["linear", "quadratic"])
def test_the_incremental_determinant_equals_the_recomputed_one(model):
    rng = np.random.default_rng(3)
    terms = model_terms(model, 3)
    # correlated columns: from a good start the swaps that are kept hang on rounding, and may be few
    near = np.arange(24.0)[:, None] + rng.normal(scale=3.0, size=(24, 3))
    coded = np.ascontiguousarray(2 * (near.argsort(axis=0).argsort(axis=0) + 0.5) / 24 - 1)
    x = model_matrix((coded + 1) / 2, model=terms)
    begin = np.linalg.slogdet(x.T @ x)[1]
    inverse = np.linalg.inv(x.T @ x)
    state = np.array([7], dtype=np.uint64)
    gain, kept = kernels.swap_columns(coded, x, inverse, *factor_lists(terms), state, 100_000)
    fresh = model_matrix((coded + 1) / 2, model=terms)
    assert kept > 10
    assert begin + gain == pytest.approx(np.linalg.slogdet(fresh.T @ fresh)[1], abs=AFTER_SWAPS)
    np.testing.assert_allclose(inverse @ (fresh.T @ fresh), np.eye(len(terms)), atol=AFTER_SWAPS)


def test_the_same_seed_gives_the_same_design():
    for sampler in (doe.d_optimal_select, doe.d_optimal_within, doe.d_optimal_best_of):
        a, b = (sampler(12, 3, rng=np.random.default_rng(4)) for _ in range(2))
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: doe.d_optimal_select(0, 2, rng=r), "n and d need whole numbers >= 1, got n=0 and d=2"),
        (lambda r: doe.d_optimal_select(20, 2, pool=10, rng=r), "pool needs at least n=20 points"),
        (lambda r: doe.d_optimal_select(4, 9, rng=r), "n=4 runs cannot estimate the 10 terms"),
        (lambda r: doe.d_optimal_select(4, 2, model="cubic", rng=r), "model needs one of linear"),
        (lambda r: doe.d_optimal_within(4, 9, rng=r), "n=4 runs cannot estimate the 10 terms"),
        (lambda r: doe.d_optimal_within(9, 2, swaps=-1, rng=r), "swaps needs a whole number >= 0, got -1"),
        (lambda r: doe.d_optimal_within(9, 2, model=lambda x: x, rng=r), "got a function"),
        (
            lambda r: doe.d_optimal_within(2, 1, model=[[0], [2]], rng=r),
            "no arrangement of the columns of n=2 runs",
        ),
        (lambda r: doe.d_optimal_within(9, 2, start=[[0.5, 0.5]], rng=r), r"start needs shape \(9, 2\)"),
        (lambda r: doe.d_optimal_best_of(4, 9, rng=r), "n=4 runs cannot estimate the 10 terms"),
        (lambda r: doe.d_optimal_best_of(4, 2, tries=0, rng=r), "tries needs a whole number >= 1, got 0"),
    ],
)
def test_bad_input_says_what_to_do(call, message):
    with pytest.raises(ValueError, match=message):
        call(np.random.default_rng(0))
