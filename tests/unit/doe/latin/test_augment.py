"""Designs that grow, nest or fall into slices; subsets, blocks, replicates, orders, sequences."""

import numpy as np
import pytest
from scipy.stats import qmc

import doe


def is_latin(points):
    n, d = points.shape
    return np.array_equal(np.sort(np.floor(points * n), axis=0), np.tile(np.arange(n)[:, None], (1, d)))


def test_a_latin_hypercube_grown_to_twice_its_size_is_one_again():
    rng = np.random.default_rng(1)
    old = doe.optimised_lhs(20, 4, swaps=5_000, rng=rng)
    grown = doe.augment(old, 20, swaps=5_000, rng=rng)
    np.testing.assert_array_equal(grown[:20], old)
    assert is_latin(grown)


def test_new_runs_are_placed_for_the_criterion():
    rng = np.random.default_rng(2)
    old = doe.optimised_lhs(20, 4, swaps=5_000, rng=rng)
    for name in ("phi_p", "cd2", "correlation"):
        random = doe.search_augmentation(old, 10, criterion=name, swaps=0, rng=np.random.default_rng(3))
        placed = doe.search_augmentation(old, 10, criterion=name, swaps=10_000, rng=np.random.default_rng(3))
        assert placed.values[name] < random.values[name]
        assert placed.swaps == 10_000


def test_the_last_rows_are_arranged_anew_and_keep_the_values_of_their_columns():
    rng = np.random.default_rng(4)
    points = np.column_stack([rng.random(30), rng.integers(0, 3, 30) / 2.0, rng.integers(0, 2, 30)])
    result = doe.search_rearrangement(points, 12, swaps=5_000, rng=rng)
    np.testing.assert_array_equal(result.points[:18], points[:18])
    np.testing.assert_array_equal(np.sort(result.points[18:], axis=0), np.sort(points[18:], axis=0))
    assert result.values["phi_p"] < doe.phi_p(points)
    for m in (0, 31):
        with pytest.raises(ValueError, match=f"m needs a number of runs from 1 to 30, got {m}"):
            doe.search_rearrangement(points, m, rng=rng)


def test_old_runs_that_share_strata_are_kept_and_gaps_are_filled():
    old = np.array([[0.1, 0.1], [0.12, 0.5], [0.9, 0.52]])
    grown = doe.augment(old, 3, swaps=500, rng=np.random.default_rng(1))
    np.testing.assert_array_equal(grown[:3], old)
    new = np.floor(grown[3:] * 6).astype(int)
    for column in range(2):
        assert len(set(new[:, column])) == 3
        assert not set(new[:, column]) & set(np.floor(old[:, column] * 6).astype(int))


def test_large_designs_grow_without_correlation():
    rng = np.random.default_rng(5)
    old = doe.decorrelated_lhs(9_000, 5, rng=rng)
    grown = doe.augment(old, 9_000, criterion="correlation", swaps=2_000, rng=rng)
    assert is_latin(grown)
    assert doe.max_correlation(grown) < 1e-4


def test_nested_designs_are_latin_at_every_level():
    points = doe.nested_lhs([5, 10, 30], 3, swaps=2_000, rng=np.random.default_rng(1))
    assert all(is_latin(points[:n]) for n in (5, 10, 30))


def test_slices_are_latin_and_so_is_their_union():
    points = doe.sliced_lhs(3, 8, 4, swaps=5_000, rng=np.random.default_rng(1))
    assert is_latin(points)
    assert all(is_latin(points[s : s + 8]) for s in (0, 8, 16))
    random = doe.sliced_lhs(3, 8, 4, swaps=0, rng=np.random.default_rng(1))
    assert doe.phi_p(points) < doe.phi_p(random)


@pytest.mark.parametrize(("n", "d"), [(60, 5), (500, 20), (2_000, 3)])
def test_decorrelated_designs_are_latin_without_correlation(n, d):
    points = doe.decorrelated_lhs(n, d, rng=np.random.default_rng(1))
    assert is_latin(points)
    assert doe.max_correlation(points) < 0.1 * doe.max_correlation(
        doe.lhs(n, d, rng=np.random.default_rng(1))
    )


def test_decorrelation_takes_what_has_no_solution():
    for n, d in ((1, 3), (2, 2), (4, 9)):
        assert is_latin(doe.decorrelated_lhs(n, d, rng=np.random.default_rng(1)))


def test_a_subset_spreads_out_and_keeps_what_it_must():
    candidates = doe.lhs(400, 3, rng=np.random.default_rng(1))
    chosen = doe.subset(candidates, 20, rng=np.random.default_rng(2))
    assert len(set(chosen.tolist())) == 20
    random = np.median([doe.phi_p(candidates[20 * k : 20 * k + 20]) for k in range(20)])
    assert doe.phi_p(candidates[chosen]) < 0.6 * random
    greedy = doe.subset(candidates, 20, trials=0, rng=np.random.default_rng(2))
    assert doe.phi_p(candidates[chosen]) < doe.phi_p(candidates[greedy])
    kept = doe.subset(candidates, 20, keep=[7, 11], rng=np.random.default_rng(2))
    assert kept[:2].tolist() == [7, 11]
    assert sorted(doe.subset(candidates, 400, rng=np.random.default_rng(2)).tolist()) == list(range(400))


@pytest.mark.parametrize(
    ("candidates", "n", "options", "message"),
    [
        ([[0.1], [0.2]], 3, {}, r"n needs 1\.\.2 of the 2 candidates, got n=3"),
        ([[0.1], [0.1], [0.2]], 3, {}, "candidates holds 2 different points, 1 are duplicates"),
        ([[0.1], [np.nan]], 1, {}, "candidates needs finite numbers, row 1 holds NaN"),
        ([[0.1], [0.2]], 1, {"keep": [2]}, "keep needs at most n=1 different row numbers"),
        ([[0.1], [0.2]], 1, {"trials": -1}, "trials needs a whole number >= 0, got -1"),
    ],
)
def test_bad_candidates_are_refused(candidates, n, options, message):
    with pytest.raises(ValueError, match=message):
        doe.subset(candidates, n, **options, rng=np.random.default_rng(1))


def test_blocks_are_equal_in_size_and_nearly_orthogonal_to_the_model():
    points = doe.optimised_lhs(24, 5, swaps=10_000, rng=np.random.default_rng(1))
    label = doe.blocks(points, 3, rng=np.random.default_rng(2))
    assert np.bincount(label).tolist() == [8, 8, 8]
    means = np.stack([points[label == b].mean(axis=0) for b in range(3)])
    assert np.abs(means - points.mean(axis=0)).max() < 0.05
    uneven = doe.blocks(points, 5, model="quadratic", rng=np.random.default_rng(2))
    assert sorted(np.bincount(uneven).tolist()) == [4, 5, 5, 5, 5]


def test_orders_are_permutations_that_respect_blocks():
    order = doe.run_order(9, rng=np.random.default_rng(1))
    assert sorted(order.tolist()) == list(range(9))
    block = np.array([2, 0, 1] * 3)
    order = doe.run_order(9, block=block, rng=np.random.default_rng(1))
    assert block[order].tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert doe.replicates(2, 3).tolist() == [0, 1, 0, 1, 0, 1]


def test_sequences_are_those_of_scipy():
    np.testing.assert_array_equal(
        doe.sobol(13, 4, rng=np.random.default_rng(3)),
        qmc.Sobol(4, rng=np.random.default_rng(3)).random_base2(4)[:13],
    )
    np.testing.assert_array_equal(
        doe.halton(13, 4, rng=np.random.default_rng(3)),
        qmc.Halton(4, rng=np.random.default_rng(3)).random(13),
    )
    assert doe.sobol(1, 2, rng=np.random.default_rng(3)).shape == (1, 2)


def test_an_orthogonal_array_fills_every_cell_of_every_pair():
    points = doe.oa_lhs(49, 8, rng=np.random.default_rng(1))
    assert is_latin(points)
    cells = np.floor(points * 7).astype(int)
    for k in range(8):
        for l in range(k):
            assert len({tuple(pair) for pair in cells[:, [k, l]].tolist()}) == 49


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda r: doe.oa_lhs(50, 3, rng=r),
            "n needs the square of a prime .* got 50; the nearest are 25, 49",
        ),
        (lambda r: doe.oa_lhs(9, 5, rng=r), "d needs at most 4 factors for an array of 9 runs, got 5"),
        (lambda r: doe.sobol(4, 30_000, rng=r), "d needs at most 21201 factors for Sobol' points"),
        (lambda r: doe.augment([[0.5]], 0, rng=r), "m needs a number of new runs >= 1, got 0"),
        (lambda r: doe.nested_lhs([4, 4], 2, rng=r), "sizes needs increasing numbers of runs"),
        (lambda r: doe.sliced_lhs(0, 4, 2, rng=r), "slices needs a whole number >= 1, got 0"),
        (lambda r: doe.decorrelated_lhs(4, 2, rounds=-1, rng=r), "rounds needs a whole number >= 0, got -1"),
        (lambda r: doe.blocks([[0.5]], 2, rng=r), r"count needs 1\.\.1 blocks for 1 runs, got 2"),
        (lambda r: doe.blocks([[0.5]], 1, trials=-1, rng=r), "trials needs a whole number >= 0, got -1"),
        (lambda r: doe.replicates(0, 2), "n and times need whole numbers >= 1, got n=0 and times=2"),
        (lambda r: doe.run_order(0, rng=r), "n needs a whole number >= 1, got 0"),
        (
            lambda r: doe.run_order(2, block=[1], rng=r),
            r"block needs one number per run, shape \(2,\), got \(1,\)",
        ),
    ],
)
def test_bad_requests_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call(np.random.default_rng(1))
