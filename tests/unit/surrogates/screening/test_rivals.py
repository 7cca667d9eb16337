"""Elementary effects, their reuse, and the other rankings."""

import numpy as np
import pytest

from surrogates.screening.hybrid import hybrid_screening
from surrogates.screening.morris import morris_effects, morris_points
from surrogates.screening.rivals import RIVALS, _in_reach, compare_rankings

RANKERS = [
    m for m in RIVALS if m not in ("forward", "welch")
]  # as published, inert inputs leave the pool first
BY_CHANCE = 0.02  # the paths of the Sobol' indices give each label its signs in turn


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
    with pytest.raises(ValueError, match=r"run_at needs the shape of points, \(35, 6\), got \(15, 6\)"):
        hybrid_screening(x, response(x), run_at=more)


def test_all_rivals_rank_a_plain_case():
    x = np.random.default_rng(4).random((60, 6))
    table = compare_rankings(x, response(x), rng=np.random.default_rng(0))
    assert [r.method for r in table] == list(RIVALS)
    for ranking in table:
        assert set(ranking.ranking[:2]) == {0, 2}, ranking.method
        assert sorted(ranking.ranking) == list(range(6))
        assert ranking.cpu_seconds >= 0


def test_labels_are_not_taken_as_ordered():
    rng = np.random.default_rng(5)
    x = rng.random((60, 5)).astype(object)
    x[:, 3] = np.array(["oak", "ash", "elm", "fir"], dtype=object)[np.arange(60) % 4]
    x[:, 4] = np.where(rng.random(60) < 0.5, "wet", "dry")
    y = x[:, 0].astype(float) + 3 * (x[:, 3] == "ash") + 2 * (x[:, 4] == "wet")
    for ranking in compare_rankings(x, y, categorical=[3, -1], methods=RANKERS, rng=rng):
        assert set(ranking.ranking[:3]) == {0, 3, 4}, ranking.method
        assert set(ranking.ranking[:2]) == {3, 4}, ranking.method
    renamed = x.copy()
    renamed[:, 3] = np.where(x[:, 3] == "ash", "zelkova", x[:, 3])
    one, other = (
        compare_rankings(z, y, categorical=[3, 4], methods=["linear", "sobol"], rng=np.random.default_rng(0))
        for z in (x, renamed)
    )
    for a, b in zip(one, other, strict=True):
        np.testing.assert_allclose(a.score, b.score, atol=BY_CHANCE)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (
            lambda x, y: (x, np.full(30, 7.0)),
            r"y is 7 in all 30 runs, so there is nothing to rank: check the",
        ),
        (lambda x, y: (np.where(x == x[4, 2], np.nan, x), y), r"X holds NaN in run 4 in column 2"),
        (lambda x, y: (x, np.r_[y[:9], np.inf, y[10:]]), r"y holds infinity in run 9"),
        (
            lambda x, y: (x, ["crash", *y[1:]]),
            r"y holds 'crash' in run 0, not a number: leave failed runs out",
        ),
        (lambda x, y: (x.astype(str), [*y[1:], None]), r"y holds None in run 29"),
        (
            lambda x, y: (np.where(x > 0.5, "high", "low"), y),
            r"column 0 holds text \('.*' in row 0\): name it",
        ),
        (lambda x, y: (x[:4], y[:4]), r"rankings need at least 5 runs, got 4: add runs"),
        (lambda x, y: (x[:0], y[:0]), r"rankings need at least 5 runs, got 0: add runs"),
        (lambda x, y: (x, y[1:]), r"X \(n, d\) and y \(n,\), got shapes \(30, 6\) and \(29,\)"),
    ],
    ids=["constant", "nan", "infinity", "text", "none", "labels", "four", "none at all", "shapes"],
)
def test_runs_that_cannot_be_ranked_are_refused_by_every_method(spoil, message):
    x = np.random.default_rng(4).random((30, 6))
    for method in RIVALS:
        with pytest.raises(ValueError, match=message):
            compare_rankings(*spoil(x, response(x)), methods=[method], rng=np.random.default_rng(0))


def test_inputs_that_never_change_are_ranked_without_a_score():
    y = np.random.default_rng(0).random(20)
    for ranking in compare_rankings(np.ones((20, 3)), y, rng=np.random.default_rng(0)):
        assert not ranking.selected
        assert list(ranking.ranking) == [0, 1, 2], ranking.method


@pytest.mark.slow
def test_dear_methods_are_left_out_where_nobody_asked_for_them():
    x = np.random.default_rng(0).random((12, 120))
    kept = [r.method for r in compare_rankings(x, x[:, 0] + x[:, 1] ** 2, rng=np.random.default_rng(0))]
    assert kept == [m for m in RIVALS if m != "quadratic"]
    assert "welch" not in _in_reach(np.zeros((301, 3)), ())


def test_unknown_rival_and_too_many_terms():
    x = np.random.default_rng(0).random((20, 120))
    with pytest.raises(ValueError, match=r"methods needs names out of default, .*got 'anova'"):
        compare_rankings(x, x[:, 0], methods=["anova"], rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"method 'quadratic' takes at most 108 inputs, got 120"):
        compare_rankings(x, x[:, 0], methods=["quadratic"], rng=np.random.default_rng(0))
