"""The swap search: its sums against plain formulas, its budgets, constraints, bits and errors."""

import hashlib

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.stats import qmc

import doe
from doe.latin.columns import CRITERIA, Columns
from doe.latin.swap_state import SwapState
from doe.latin.swaps import swap_search
from doe.portable.draws import level_permutations, splitmix

# rounding of 1e5 incremental updates, refreshed on the way
DRIFT = 1e-10
ALL = ("phi_p", "cd2", "maxpro", "correlation")


def latin(n, d):
    return Columns(levels=np.tile((np.arange(n) + 0.5) / n, (d, 1)), nominal=np.zeros(d, bool))


def mixed(n):
    """Two continuous columns, one of four levels, one binary, one of three words."""
    levels = [doe.balanced_levels(m, n) for m in (None, None, 4, 2, 3)]
    return Columns(levels=np.stack(levels), nominal=np.array([False, False, False, False, True]))


def plain_values(search):
    """The four criteria on the search's scale, from the coordinates by plain formulas."""
    x, u, nominal = search.design.x.astype(float), search.design.u, search.columns.nominal
    n = x.shape[1]
    i, j = np.triu_indices(n, 1)
    unlike = x[:, i] != x[:, j]
    squares = np.where(
        nominal[:, None], search.criteria.distances.apart * unlike, (x[:, i] - x[:, j]) ** 2
    ).sum(axis=0)
    phi = float((squares**-search.criteria.distances.half_power).sum()) if squares.min() > 0 else np.inf
    z = np.where(nominal[:, None], 0.5, np.abs(u - 0.5))
    gap = np.where(nominal[:, None, None], u[:, :, None] != u[:, None, :], abs(u[:, :, None] - u[:, None, :]))
    products = np.prod(1 + 0.5 * (z[:, :, None] + z[:, None, :] - gap), axis=0)
    cd2 = (13 / 12) ** len(x) * n * n - 2 * n * np.prod(1 + z / 2 - z**2 / 2, axis=0).sum() + products.sum()
    distance = search.criteria.gaps.unit * np.abs(x[:, i] - x[:, j])
    distance[nominal] = np.exp(1.5) * unlike[nominal]
    maxpro = float(np.prod((distance + search.criteria.gaps.shifts[:, None]) ** -2.0, axis=0).sum())
    r = np.corrcoef(x[~nominal])[np.triu_indices(int((~nominal).sum()), 1)]
    return np.array([phi, cd2, maxpro, (r**8).sum()])


@pytest.mark.parametrize("columns", [latin(24, 4), mixed(24)], ids=["latin", "mixed"])
def test_incremental_sums_equal_plain_ones_after_a_hundred_thousand_swaps(columns):
    d, n = columns.levels.shape
    draws = splitmix(np.random.default_rng(5))
    groups = np.array([[0, n]])
    start = level_permutations(n, d, draws)
    search = SwapState(columns, start, names=ALL, p=4, groups=groups, draws=draws, positions=True)
    search.weigh(np.ones(4), search.criteria.values)
    search.run(100_000, heat=0.2, cooled=1.0, feasible=None)
    assert search.progress[1] > 1_000
    kept = search.criteria.values[:4] / np.append(search.criteria.scales[:3], 1.0)
    np.testing.assert_allclose(kept, plain_values(search), rtol=DRIFT)
    np.testing.assert_array_equal(np.sort(search.design.entries, axis=1), np.tile(np.arange(n), (d, 1)))
    best = search.best.values[4]
    search.back_to_best()
    again = np.append(
        plain_values(search)[:3] * search.criteria.scales[:3] * search.criteria.weights[:3], 0.0
    )
    again[3] = search.criteria.weights[3] * (plain_values(search)[3] / search.criteria.pairs) ** 0.125
    assert again.sum() == pytest.approx(best, rel=DRIFT)


@pytest.mark.parametrize("name", CRITERIA)
def test_the_result_carries_the_criterion_of_its_points(name):
    found = doe.search_lhs(30, 5, criterion=name, swaps=4_000, rng=np.random.default_rng(1))
    pairs = pdist(found.points)
    i, j = np.triu_indices(30, 1)
    expected = {
        "phi_p": (pairs**-10.0).sum() ** 0.1,
        "cd2": qmc.discrepancy(found.points),
        "maxpro": np.mean(np.prod((found.points[i] - found.points[j]) ** -2.0, axis=1)) ** 0.2,
        "correlation": np.abs(np.corrcoef(found.points.T) - np.eye(5)).max(),
    }
    assert found.values[name] == pytest.approx(expected[name], rel=1e-9)
    assert found.swaps == 4_000
    np.testing.assert_allclose(found.points, (found.entries + 0.5) / 30)


@pytest.mark.parametrize("name", CRITERIA)
def test_more_swaps_give_better_designs(name):
    random = doe.search_lhs(40, 6, criterion=name, swaps=0, rng=np.random.default_rng(3)).values[name]
    few = doe.search_lhs(40, 6, criterion=name, swaps=2_000, rng=np.random.default_rng(3)).values[name]
    many = doe.search_lhs(40, 6, criterion=name, swaps=60_000, rng=np.random.default_rng(3)).values[name]
    assert many < few < random


def test_small_designs_reach_the_known_optimum():
    # van Dam, Husslage, den Hertog & Melissen 2007: maximin 5 x 2 has squared distance 5, 9 x 2 has 10
    for n, squared in ((5, 5), (9, 10)):
        found = doe.search_lhs(n, 2, swaps=20_000, p=40, rng=np.random.default_rng(2))
        assert round((n * doe.min_distance(found.points)) ** 2) == squared


def test_several_criteria_are_traded_off_by_their_weights():
    def joint(weights):
        return doe.search_lhs(
            30, 4, criterion=("phi_p", "cd2"), weights=weights, swaps=40_000, rng=np.random.default_rng(4)
        )

    spread, even = joint((10, 1)), joint((1, 10))
    assert spread.values["phi_p"] < even.values["phi_p"]
    assert spread.values["cd2"] > even.values["cd2"]
    assert set(spread.alone) == {"phi_p", "cd2"}
    assert spread.values["phi_p"] < 1.05 * spread.alone["phi_p"]
    assert even.values["cd2"] < 1.10 * even.alone["cd2"]


def test_a_seed_gives_these_bits_everywhere():
    # entries found on x86-64; decisions are taken on whole numbers, so any platform must agree
    expected = {
        "phi_p": "ce08613b3a8c8ebb",
        "cd2": "f90f86ff913e4ea1",
        "maxpro": "5dfec0b4a225a05f",
        "correlation": "43fdcbd6daf58b73",
    }
    found = {
        name: hashlib.sha256(
            doe.search_lhs(20, 5, criterion=name, swaps=20_000, rng=np.random.default_rng(11))
            .entries.astype("<i4")
            .tobytes()
        ).hexdigest()[:16]
        for name in CRITERIA
    }
    assert found == expected


def test_a_budget_in_seconds_reports_swaps_that_replay_it():
    found = doe.search_lhs(20, 4, seconds=0.1, rng=np.random.default_rng(3))
    assert found.swaps > 1_000
    again = doe.search_lhs(20, 4, swaps=found.swaps, rng=np.random.default_rng(3))
    np.testing.assert_array_equal(found.points, again.points)


def test_constraints_hold_for_every_run_and_do_not_stop_the_search():
    def feasible(points):
        return np.abs(points[:, 0] - points[:, 1]) < 0.6

    found = doe.optimised_levels([None] * 3, 25, feasible=feasible, swaps=5_000, rng=np.random.default_rng(6))
    assert feasible(found.points).all()
    np.testing.assert_allclose(
        np.sort(found.points, axis=0), np.tile(((np.arange(25) + 0.5) / 25)[:, None], (1, 3))
    )
    start = doe.optimised_levels([None] * 3, 25, feasible=feasible, swaps=0, rng=np.random.default_rng(6))
    assert found.values["phi_p"] < start.values["phi_p"]


def test_degenerate_sizes_are_designs_too():
    for n, d in ((1, 1), (1, 4), (2, 1), (3, 7)):
        for criterion in (*CRITERIA, ALL):
            points = doe.optimised_lhs(n, d, criterion=criterion, swaps=50, rng=np.random.default_rng(1))
            assert points.shape == (n, d)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"criterion": "beauty"}, "criterion needs phi_p, cd2, maxpro, correlation, .* got 'beauty'"),
        ({"criterion": ("cd2", "cd2")}, "criterion needs at least one name and each once"),
        ({"criterion": ()}, "criterion needs at least one name"),
        ({"weights": (1.0, 2.0)}, "weights needs one positive number per criterion"),
        ({"weights": (0.0,)}, "weights needs one positive number per criterion"),
        ({"swaps": -1}, "swaps needs a whole number >= 0, got -1"),
        ({"seconds": 0.0}, "seconds needs a positive number, got 0.0"),
        ({"swaps": 10, "seconds": 1.0}, "needs either swaps or seconds, got swaps=10 and seconds=1.0"),
        ({"p": 5}, "p needs an even whole number >= 2, got 5"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        doe.optimised_lhs(5, 2, **options, rng=np.random.default_rng(1))


@pytest.mark.parametrize("sampler", [doe.lhs, doe.centred_lhs, doe.ihs, doe.optimised_lhs])
def test_bad_sizes_and_generators_are_refused(sampler):
    rng = np.random.default_rng(1)
    for n, d, message in (
        (0, 2, "n needs a whole number of runs >= 1, got 0"),
        (3, 0, "d needs a whole number of factors >= 1, got 0"),
        (2.5, 2, "n needs a whole number of runs >= 1, got 2.5"),
        (10**11, 2, "n needs a whole number of runs >= 1 and <= 2147483647, got 100000000000"),
    ):
        with pytest.raises(ValueError, match=message):
            sampler(n, d, rng=rng)
    with pytest.raises(TypeError, match=r"rng needs a numpy.random.Generator, got 3"):
        sampler(3, 2, rng=3)


def test_a_search_too_large_for_its_tables_is_refused_with_a_way_out():
    with pytest.raises(ValueError, match=r"takes n <= 8192, got n=9000; use criterion='correlation'"):
        doe.optimised_lhs(9000, 2, rng=np.random.default_rng(1))
    points = doe.optimised_lhs(9000, 3, criterion="correlation", swaps=3_000, rng=np.random.default_rng(1))
    assert doe.max_correlation(points) < 5e-3


def test_groups_keep_the_other_runs_where_they_are():
    columns = latin(12, 3)
    draws = splitmix(np.random.default_rng(1))
    start = level_permutations(12, 3, draws)
    found = swap_search(
        columns, start, criterion="phi_p", swaps=2_000, groups=np.array([[4, 5], [9, 3]]), draws=draws
    )
    np.testing.assert_array_equal(found.entries[:4], start.T[:4])
    for part in (slice(4, 9), slice(9, 12)):
        np.testing.assert_array_equal(np.sort(found.entries[part], axis=0), np.sort(start.T[part], axis=0))
    assert not np.array_equal(found.entries, start.T)
