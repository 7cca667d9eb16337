"""Elementary effects, their reuse, and the other rankings."""

import numpy as np
import pytest

from surrogates.hybrid import hybrid_screening
from surrogates.morris import morris_effects, morris_points
from surrogates.rivals import RIVALS, compare_rankings


def response(x):
    return 4 * x[:, 0] + 3 * np.sin(3 * x[:, 2]) + 2 * x[:, 0] * x[:, 2]


def test_points_lie_on_the_grid_and_levels_are_balanced():
    x = morris_points(6, 200, rng=np.random.default_rng(0))
    assert x.shape == (1400, 6)
    levels, counts = np.unique(x.round(12), return_counts=True)
    np.testing.assert_allclose(levels, [0, 1 / 3, 2 / 3, 1])
    assert counts.min() > 0.2 * counts.sum()


def test_effects_of_a_linear_function_are_its_slopes():
    rng = np.random.default_rng(1)
    slopes = rng.normal(size=7)
    x = morris_points(7, 5, rng=rng)
    found = morris_effects(x, x @ slopes)
    np.testing.assert_allclose(found.mu, slopes, atol=1e-12)
    np.testing.assert_allclose(found.sigma, 0, atol=1e-12)
    assert list(found.ranking) == list(np.argsort(-np.abs(slopes)))
    assert found.n_runs == 40


def test_one_trajectory_has_no_spread():
    x = morris_points(3, 1, rng=np.random.default_rng(0))
    assert np.isnan(morris_effects(x, x[:, 0]).sigma).all()


def test_bad_trajectories_are_refused():
    x = morris_points(3, 2, rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"trajectories of 4 runs of 3 inputs .*got 7 runs and 7 responses"):
        morris_effects(x[:7], np.zeros(7))
    with pytest.raises(ValueError, match=r"response of run 5 is not finite"):
        morris_effects(x, np.where(np.arange(8) == 5, np.nan, 1.0))
    with pytest.raises(ValueError, match=r"points are not Morris trajectories"):
        morris_effects(np.random.default_rng(0).random((8, 3)), np.zeros(8))
    with pytest.raises(ValueError, match=r"at least 1, got d=0"):
        morris_points(0, 1, rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"levels needs an even number from 2 on, got 3"):
        morris_points(2, 1, levels=3, rng=np.random.default_rng(0))


def test_hybrid_reuses_the_runs():
    rng = np.random.default_rng(3)
    x = morris_points(6, 5, rng=rng)
    more = rng.random((15, 6))
    found = hybrid_screening(x, response(x), more_points=more, more_y=response(more))
    assert set(found.agreed) == {0, 2}
    assert found.disputed == ()
    assert found.screener.diagnosis_.n_runs == 50
    with pytest.raises(ValueError, match=r"more_points and more_y belong together"):
        hybrid_screening(x, response(x), more_points=more)


def test_all_rivals_rank_a_plain_case():
    x = np.random.default_rng(4).random((60, 6))
    table = compare_rankings(x, response(x), rng=np.random.default_rng(0))
    assert [r.method for r in table] == list(RIVALS)
    for ranking in table:
        assert set(ranking.ranking[:2]) == {0, 2}, ranking.method
        assert sorted(ranking.ranking) == list(range(6))
        assert ranking.cpu_seconds >= 0


def test_unknown_rival_and_too_many_terms():
    x = np.random.default_rng(0).random((20, 120))
    with pytest.raises(ValueError, match=r"methods needs names out of default, .*got 'anova'"):
        compare_rankings(x, x[:, 0], methods=["anova"], rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"method 'quadratic' takes at most 108 inputs, got 120"):
        compare_rankings(x, x[:, 0], methods=["quadratic"], rng=np.random.default_rng(0))
