"""Balanced levels, arranged jointly."""

import numpy as np
import pytest

import doe


@pytest.mark.parametrize(
    ("levels", "n", "counts"),
    [
        (2, 7, {0.0: 4, 1.0: 3}),
        (3, 7, {0.0: 2, 0.5: 3, 1.0: 2}),
        ([0.0, 0.1, 1.0], 6, {0.0: 2, 0.1: 2, 1.0: 2}),
        (1, 3, {0.5: 3}),
    ],
)
def test_levels_are_balanced(levels, n, counts):
    values, found = np.unique(doe.balanced_levels(levels, n), return_counts=True)
    assert values.tolist() == list(counts)
    assert sorted(found.tolist()) == sorted(counts.values())


def test_of_more_levels_than_runs_evenly_spread_ones_are_taken():
    # grip from 350 to 700 N in steps of 7 N: 51 levels, ten runs
    values = doe.balanced_levels(51, 10)
    assert len(np.unique(values)) == 10
    np.testing.assert_allclose(np.diff(values), 0.1, atol=0.021)
    np.testing.assert_allclose(values * 50, np.rint(values * 50), atol=1e-12)


def test_mixed_factors_are_balanced_and_better_than_rounding():
    kinds = [None, None, 5, 2, 3]
    found = doe.optimised_levels(kinds, 20, nominal=[4], swaps=20_000, rng=np.random.default_rng(2))
    expected = np.stack([doe.balanced_levels(kind, 20) for kind in kinds], axis=1)
    np.testing.assert_array_equal(np.sort(found.points, axis=0), expected)
    random = doe.optimised_levels(kinds, 20, nominal=[4], swaps=0, rng=np.random.default_rng(2))
    assert found.values["phi_p"] < random.values["phi_p"]


def test_binary_columns_become_a_factorial():
    found = doe.optimised_levels([2, 2, 2], 8, swaps=5_000, rng=np.random.default_rng(1))
    assert len(np.unique(found.points, axis=0)) == 8
    assert doe.max_correlation(found.points) == pytest.approx(0.0, abs=1e-12)


def test_nominal_levels_have_no_order():
    # three words in three runs beside one continuous column: every arrangement is as good as any other
    ordered, nominal = (
        doe.rearrange(
            [[0.0, 0.0], [0.5, 0.5], [1.0, 1.0]],
            nominal=columns,
            criterion="cd2",
            swaps=500,
            rng=np.random.default_rng(1),
        )
        for columns in ([], [1])
    )
    assert ordered.accepted > 0
    assert not np.array_equal(ordered.points[:, 0], ordered.points[:, 1])
    np.testing.assert_array_equal(np.sort(nominal.points, axis=0)[:, 1], [0.0, 0.5, 1.0])


def test_what_a_design_of_words_is_judged_by_does_not_see_their_codes():
    rng = np.random.default_rng(7)
    words = np.repeat([0.0, 0.5, 1.0], 4)
    points = np.column_stack(
        [(rng.permutation(12) + 0.5) / 12, rng.permutation(words), rng.permutation(words)]
    )
    recoded = points.copy()
    recoded[:, 1] = np.array([0.5, 0.0, 1.0])[(2 * points[:, 1]).astype(int)]
    criteria = ("phi_p", "cd2", "correlation")
    first, second = (
        doe.rearrange(u, nominal=[1, 2], criterion=criteria, swaps=0, rng=rng).values
        for u in (points, recoded)
    )
    assert first == pytest.approx(second)
    assert first["correlation"] == 0.0  # of one ordered column
    unlike = (points[:, None, 1:] != points[None, :, 1:]).sum(axis=2)
    squares = ((points[:, None, 0] - points[None, :, 0]) ** 2 + unlike)[np.triu_indices(12, 1)]
    assert first["phi_p"] == pytest.approx((squares**-5.0).sum() ** 0.1)


def test_two_words_are_the_ends_of_a_range():
    rng = np.random.default_rng(8)
    points = np.column_stack([(rng.permutation(12) + 0.5) / 12, rng.permutation(np.repeat([0.0, 1.0], 6))])
    found = doe.rearrange(points, nominal=[1], criterion="cd2", swaps=0, rng=rng)
    assert found.values["cd2"] == pytest.approx(doe.discrepancies(points)[0])


def test_rearranging_keeps_columns_and_improves():
    rng = np.random.default_rng(4)
    start = np.round(rng.random((30, 4)), 1)
    found = doe.rearrange(start, criterion=("cd2", "correlation"), swaps=10_000, rng=rng)
    np.testing.assert_array_equal(np.sort(found.points, axis=0), np.sort(start, axis=0))
    assert doe.cd2(found.points) < doe.cd2(start)
    assert doe.max_correlation(found.points) < doe.max_correlation(start)


def test_constraints_hold_with_levels_in_balance():
    def feasible(points):
        return ~((points[:, 0] == 1.0) & (points[:, 1] == 1.0))  # a forbidden combination

    found = doe.optimised_levels(
        [3, 3, None], 18, feasible=feasible, swaps=5_000, rng=np.random.default_rng(1)
    )
    assert feasible(found.points).all()
    np.testing.assert_array_equal(np.sort(found.points[:, 0]), np.repeat([0.0, 0.5, 1.0], 6))


def test_a_contradicting_constraint_says_how_far_it_came():
    def feasible(points):
        return points.sum(axis=1) < 0.5  # the mean of a Latin hypercube's row sums is d/2

    with pytest.raises(ValueError, match=r"not satisfied by any arrangement found: at best \d+ of 12 runs"):
        doe.optimised_levels([None] * 3, 12, feasible=feasible, rng=np.random.default_rng(1))


@pytest.mark.parametrize(
    ("levels", "options", "message"),
    [
        ([], {}, "levels needs one entry per column, got none"),
        ([0], {}, "levels of a column needs at least one level, got 0"),
        ([[]], {}, "levels of a column needs at least one level, got none"),
        ([[0.1, 1.2]], {}, r"levels of a column needs finite positions in \[0, 1\]"),
        ([[0.1, 0.1]], {}, "levels of a column needs each level once"),
        ([2], {"nominal": [1]}, r"nominal needs column numbers in 0\.\.0, got 1"),
        ([2], {"feasible": lambda points: True}, r"feasible needs to return one truth value per point"),
    ],
)
def test_bad_levels_are_refused(levels, options, message):
    with pytest.raises(ValueError, match=message):
        doe.optimised_levels(levels, 4, **options, rng=np.random.default_rng(1))
