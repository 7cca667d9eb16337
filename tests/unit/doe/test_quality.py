"""Metrics against scipy and plain formulas; percentiles; errors."""

import json

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.stats import qmc

import doe
from doe import quality as quality_module  # the function: the module is not shadowed
from doe.criteria import _kernels_spread as kernels
from doe.quality import BETTER

# sums of positive terms in another order
ROUNDING = 1e-12
SIZES = [(2, 1), (7, 3), (50, 20), (300, 6)]


@pytest.mark.parametrize(("n", "d"), SIZES)
def test_discrepancies_agree_with_scipy(n, d):
    points = np.random.default_rng(n).random((n, d))
    expected = [qmc.discrepancy(points, method=method) for method in ("CD", "WD", "MD")]
    np.testing.assert_allclose(doe.discrepancies(points), expected, rtol=ROUNDING * 1e3, atol=ROUNDING)
    assert doe.cd2(points) == pytest.approx(expected[0], rel=ROUNDING, abs=ROUNDING)


@pytest.mark.parametrize(("n", "d"), SIZES)
def test_distance_metrics_agree_with_all_pairs(n, d):
    points = np.random.default_rng(n).random((n, d))
    pairs = pdist(points)
    assert doe.min_distance(points) == pytest.approx(pairs.min(), rel=ROUNDING)
    for p in (2, 10, 40):
        assert doe.phi_p(points, p=p) == pytest.approx((pairs**-p).sum() ** (1 / p), rel=ROUNDING)
    i, j = np.triu_indices(n, 1)
    product = np.prod((points[i] - points[j]) ** 2, axis=1)
    assert doe.maxpro(points) == pytest.approx(np.mean(1 / product) ** (1 / d), rel=ROUNDING)


def test_correlations_agree_with_numpy_and_a_constant_column_has_none():
    points = np.random.default_rng(2).random((30, 5))
    np.testing.assert_allclose(doe.correlations(points), np.corrcoef(points.T), atol=ROUNDING)
    points[:, 2] = 0.3
    assert np.abs(doe.correlations(points)[2, [0, 1, 3, 4]]).max() == 0.0
    off = np.corrcoef(points[:, [0, 1, 3, 4]].T)[np.triu_indices(4, 1)]
    assert doe.max_correlation(points) == pytest.approx(np.abs(off).max(), abs=ROUNDING)


def test_projections_are_the_discrepancies_of_pairs_of_columns():
    points = np.random.default_rng(3).random((40, 4))
    table = doe.projection_cd2(points)
    for k in range(4):
        for l in range(k):
            assert table[k, l] == pytest.approx(qmc.discrepancy(points[:, [l, k]]), abs=ROUNDING)
    found = doe.quality(points, references=3, rng=np.random.default_rng(1))
    l, k = found.worst_pair
    assert found.worst_pair_cd2 == pytest.approx(np.nanmax(table)) == pytest.approx(table[k, l])


def test_a_sample_of_all_rows_gives_the_exact_sums():
    points = np.random.default_rng(5).random((300, 4))
    columns, rows = np.ascontiguousarray(points.T), np.arange(300)
    for half, factor in ((True, 1.0), (False, 0.5)):
        nearest, sums = np.full(300, 1e300), np.empty(300)
        kernels.distances(columns, rows, half, 5, nearest, sums)
        assert factor * sums.sum() == pytest.approx(doe.phi_p(points) ** 10, rel=ROUNDING)
        np.testing.assert_allclose(np.sqrt(nearest), doe.nearest_distances(points), rtol=ROUNDING)
        triple = np.empty((3, 300))
        kernels.discrepancies(columns, rows, half, triple)
        kernels.centred_products(columns, rows, half, sums)
        np.testing.assert_allclose(sums, triple[0], rtol=ROUNDING)
        kernels.projections(columns, rows, half, sums)
        pairs = 300 * 299 / 2
        assert (factor * sums.sum() / pairs) ** 0.25 == pytest.approx(doe.maxpro(points), rel=ROUNDING)


def test_quality_holds_the_metrics_of_the_design():
    points = doe.lhs(30, 4, rng=np.random.default_rng(8))
    found = doe.quality(points, "quadratic", references=20, rng=np.random.default_rng(9))
    assert (found.n, found.d, found.model, found.references) == (30, 4, "quadratic", 20)
    for name, value in (
        ("min_distance", doe.min_distance(points)),
        ("nearest_mean", doe.nearest_distances(points).mean()),
        ("phi_p", doe.phi_p(points)),
        ("maxpro", doe.maxpro(points)),
        ("max_correlation", doe.max_correlation(points)),
        ("rms_correlation", doe.rms_correlation(points)),
        ("max_vif", doe.variance_inflation(points, model="quadratic").max()),
        ("d_efficiency", doe.d_efficiency(points, model="quadratic")),
        ("a_efficiency", doe.a_efficiency(points, model="quadratic")),
        ("i_efficiency", doe.i_efficiency(points, model="quadratic")),
    ):
        assert getattr(found, name) == pytest.approx(value, rel=1e-10), name
    np.testing.assert_allclose([found.cd2, found.wd2, found.md], doe.discrepancies(points), rtol=1e-10)
    probes = qmc.Sobol(4, scramble=False).random(512)
    reach = np.sqrt(((probes[:, None] - points[None]) ** 2).sum(axis=2)).min(axis=1).max()
    assert found.fill_distance == pytest.approx(reach)
    nearest = doe.nearest_distances(points)
    assert found.mesh_ratio == pytest.approx(nearest.max() / nearest.min())
    bound = np.sqrt(np.floor(30 * 31 * 4 / 6)) / 30
    assert found.distance_bound_share == pytest.approx(found.min_distance / bound)
    assert found.intervals == {}


def test_percentiles_separate_good_from_bad():
    rng = np.random.default_rng(3)
    good = doe.quality(doe.optimised_lhs(30, 5, swaps=20_000, rng=rng), references=50, rng=rng)
    assert good.beats("phi_p") == good.beats("min_distance") == good.beats("cd2") == 100.0
    assert good.percentiles["phi_p"] == 0.0
    assert good.percentiles["min_distance"] == 100.0
    clustered = doe.quality(0.1 * doe.lhs(30, 5, rng=rng), references=50, rng=rng)
    assert clustered.beats("cd2") == 0.0
    typical = [
        doe.quality(doe.lhs(30, 5, rng=rng), references=50, rng=rng).percentiles["cd2"] for _ in range(20)
    ]
    assert 20.0 < np.mean(typical) < 80.0


def test_the_dictionary_is_plain_json():
    found = doe.quality([[0.5, 0.5]], references=4, rng=np.random.default_rng(1))
    table = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert set(table) == set(BETTER)
    assert table["min_distance"] == {"value": None, "percentile": None, "better": "high"}


def test_duplicate_runs_are_seen():
    points = np.vstack([doe.lhs(9, 3, rng=np.random.default_rng(1)), [[0.5, 0.5, 0.5]] * 2])
    found = doe.quality(points, references=5, rng=np.random.default_rng(1))
    assert found.min_distance == 0.0
    assert found.phi_p == np.inf
    assert doe.phi_p(points) == np.inf
    assert found.beats("phi_p") == 0.0


def test_large_designs_are_sampled_with_bounds_that_hold_the_truth():
    rng = np.random.default_rng(6)
    points = doe.lhs(9_000, 8, rng=rng)
    found = doe.quality(points, references=1, rng=rng)
    assert set(found.intervals) >= {"cd2", "phi_p", "nearest_mean", "min_distance"}
    exact = doe.nearest_distances(points)
    low, high = found.intervals["nearest_mean"]
    assert low - (high - low) < exact.mean() < high + (high - low)
    assert exact.min() <= found.min_distance
    low, high = found.intervals["cd2"]
    assert low - (high - low) < doe.cd2(points) < high + (high - low)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0.1, np.nan], [0.2, 0.3]], "points needs finite numbers, row 0 holds NaN"),
        ([[0.1, 0.2], [0.2, 1.5]], r"points needs values in \[0, 1\], row 1 column 1 holds 1.5"),
        ([0.1, 0.2], "points needs shape"),
    ],
)
def test_bad_points_are_refused(points, message):
    with pytest.raises(ValueError, match=message):
        doe.quality(points, rng=np.random.default_rng(1))


def test_bad_arguments_are_refused():
    rng = np.random.default_rng(1)
    with pytest.raises(ValueError, match="references needs a whole number >= 1, got 0"):
        quality_module([[0.5]], references=0, rng=rng)
    with pytest.raises(ValueError, match="p needs an even whole number >= 2, got 3"):
        doe.phi_p([[0.1], [0.2]], p=3)
    with pytest.raises(ValueError, match=r"metric needs one of .*, got 'beauty'"):
        doe.quality([[0.1], [0.5]], references=2, rng=rng).beats("beauty")
