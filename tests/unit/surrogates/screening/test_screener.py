"""The screener does its job, keeps its contract, and takes bad input with a cure."""

import numpy as np
import pytest
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.utils.estimator_checks import parametrize_with_checks

from surrogates import KrigingScreener, restricted_log_likelihood, selection_stability
from surrogates.errors import TooFewRuns
from surrogates.screening.sets.rules import threshold_for
from tests.plain_kriging import plain

METHODS = ["default", "forward", "welch"]


def data(n=32, d=6, seed=1, noise=0.0):
    rng = np.random.default_rng(seed)
    x = rng.random((n, d))
    y = np.sin(5 * x[:, 2]) + 2 * x[:, 4] * x[:, 1] + noise * rng.standard_normal(n)
    return x, y


@parametrize_with_checks([KrigingScreener(n_starts=6, enough=2), KrigingScreener(method="forward")])
@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.mark.parametrize("method", METHODS)
def test_finds_what_is_plain(method):
    x, y = data()
    screener = KrigingScreener(method=method).fit(x, y)
    assert set(screener.selected_) == {1, 2, 4}
    assert sorted(screener.ranking_) == list(range(6))
    assert set(screener.ranking_[:3]) == {1, 2, 4}
    assert screener.transform(x).shape == (32, 3)
    assert list(screener.get_feature_names_out()) == ["x1", "x2", "x4"]
    assert screener.diagnosis_.q2 > 0.8


@pytest.mark.parametrize("method", ["default", "forward"])
def test_path_states_the_likelihood_in_the_units_given(method):
    x, y = data()
    x, y = 1 + 3 * x, 40 - 7 * y
    screener = KrigingScreener(method=method).fit(x, y)
    before = screener.diagnosis_.base_log_likelihood
    for step in screener.path_:
        l = restricted_log_likelihood(step.theta, step.sigma2, x, y, nugget=step.nugget)
        assert step.log_likelihood == pytest.approx(l, abs=1e-6)
        assert step.gain == pytest.approx(step.log_likelihood - before, abs=1e-8)
        before = step.log_likelihood
    assert list(screener.selected_) == list([s for s in screener.path_ if s.accepted][-1].selected)


def test_forward_goes_one_step_beyond_the_rule_or_as_far_as_asked():
    x, y = data()
    screener = KrigingScreener(method="forward").fit(x, y)
    assert [s.accepted for s in screener.path_] == [True] * 3 + [False]
    assert screener.path_[-1].gain < screener.diagnosis_.threshold
    asked = KrigingScreener(method="forward", n_features=5).fit(x, y)
    assert len(asked.selected_) == len(asked.path_) == 5


def test_number_of_inputs_can_be_fixed():
    x, y = data()
    for size in (1, 2, 5, 6, 9):
        assert len(KrigingScreener(n_features=size).fit(x, y).selected_) == min(size, 6)


def test_pure_noise_selects_nothing():
    """At most one sample in twenty may seem to depend on something; 12 % did before none was preferred."""
    wrong = 0
    for seed in range(20):
        rng = np.random.default_rng([seed, 50, 5, 7])
        x, y = rng.random((50, 5)), rng.standard_normal(50)
        screener = KrigingScreener(n_starts=50).fit(x, y)
        wrong += len(screener.selected_) > 0
        assert sorted(screener.ranking_) == list(range(5))
        assert not screener.diagnosis_.resolved
    assert wrong <= 1


def test_one_weak_input_is_told_from_nothing():
    rng = np.random.default_rng(3)
    x = rng.random((50, 5))
    screener = KrigingScreener().fit(x, x[:, 3] + 0.4 * rng.standard_normal(50))
    assert list(screener.selected_) == [3]


def test_margin_of_a_large_design_counts_the_weakest_input():
    rng = np.random.default_rng(2)
    x = rng.random((260, 6))
    y = np.sin(5 * x[:, 0]) + x[:, 1] + 0.003 * x[:, 2]  # 130 runs do not show the last
    screener = KrigingScreener().fit(x, y)
    assert (set(screener.selected_), set(screener.minor_)) == ({0, 1}, {2})
    last = [s for s in screener.path_ if s.accepted][-1]
    assert screener.diagnosis_.margin <= last.gain - screener.diagnosis_.threshold + 1e-6


@pytest.mark.slow
def test_what_a_part_of_the_runs_hides_is_sought_in_another_part():
    """The first 130 of these 500 runs lead to a set without the input that acts through interactions only."""
    from studies.screening_functions import FUNCTIONS

    rng = np.random.default_rng(41011)
    x = rng.random((500, 100))
    y = FUNCTIONS["welch"].evaluate(x[:, :20])
    rng.standard_normal(500)
    order = rng.permutation(100)
    screener = KrigingScreener().fit(x[:, order], y)
    assert set(order[screener.ranking_[:6]]) == set(FUNCTIONS["welch"].active)
    assert screener.diagnosis_.q2 > 0.99


def test_pure_noise_is_not_resolved():
    rng = np.random.default_rng(5)
    screener = KrigingScreener().fit(rng.random((40, 8)), rng.standard_normal(40))
    assert not screener.diagnosis_.resolved
    assert screener.diagnosis_.verdict.startswith("not resolved")
    assert screener.diagnosis_.advice


def test_ranking_goes_on_beyond_the_selection():
    """Too few runs for the weak inputs to be selected: they should still stand before the inert ones."""
    first = selected = 0
    for seed in range(6):
        x = np.random.default_rng(seed).random((24, 10))
        y = np.sin(5 * x[:, 3]) + x[:, 7] + 0.35 * x[:, 1] + 0.35 * x[:, 9]
        screener = KrigingScreener(threshold=6.0).fit(x, y)
        k = len(screener.selected_)
        assert list(screener.ranking_[:k]) == list(screener.selected_)
        assert sorted(screener.ranking_) == list(range(10))
        selected += set(screener.selected_) >= {1, 3, 7, 9}
        first += set(screener.ranking_[:4]) == {1, 3, 7, 9}
    assert first >= 5
    assert first >= selected


def test_grouped_inputs_enter_together():
    x, _ = data(50)
    y = np.sin(5 * x[:, 2]) + np.cos(4 * x[:, 0]) + 2 * x[:, 1]
    screener = KrigingScreener(groups=[(2, 0), (3, 5)]).fit(x, y)
    assert set(screener.selected_) == {0, 1, 2}
    step = next(s for s in screener.path_ if 2 in s.added)
    assert step.added == (0, 2)
    spread = np.ptp(x, axis=0)
    np.testing.assert_allclose(step.theta[0] * spread[0] ** 2, step.theta[2] * spread[2] ** 2)


def test_labels_as_strings():
    rng = np.random.default_rng(2)
    x = np.empty((40, 5), dtype=object)
    x[:] = rng.random((40, 5))
    x[:, 3] = rng.choice(["steel", "alu", "wood"], 40)
    y = np.array([{"steel": 2.0, "alu": 0.0, "wood": 5.0}[m] for m in x[:, 3]]) + x[:, 1].astype(float)
    screener = KrigingScreener(categorical=[3]).fit(x, y)
    assert set(screener.selected_) == {1, 3}
    assert screener.transform(x).shape == (40, 2)
    with pytest.raises(ValueError, match=r"column 3 holds text .*categorical=\[3\]"):
        KrigingScreener().fit(x, y)


def test_works_in_a_pipeline():
    x, y = data(60)
    assert make_pipeline(KrigingScreener(), LinearRegression()).fit(x, y).score(x, y) > 0.5


def test_a_pipeline_behind_a_screener_that_selects_nothing_says_so():
    x = np.random.default_rng(0).random((30, 4))
    noise = np.random.default_rng(3).standard_normal(30)
    with pytest.raises(
        ValueError, match=r"0 feature\(s\) .* Behind a screener .* it selected no input: read its"
    ):
        make_pipeline(KrigingScreener(), plain()).fit(x, noise)


def test_duplicates_constants_and_repeats_are_facts_not_errors():
    x, y = data(40)
    x = np.column_stack([x, np.full(40, 3.0), 5 - 2 * x[:, 2]])
    x[7], y[7] = x[3], y[3]
    x[11] = x[12]  # equal inputs, unequal responses
    diagnosis = KrigingScreener().fit(x, y).diagnosis_
    assert diagnosis.duplicates == ((3, 7), (11, 12))
    assert diagnosis.constant == (6,)
    assert diagnosis.repeated == ((2, 7),)
    assert "2 and 7 cannot be told apart" in diagnosis.advice


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "change",
    [
        lambda x, y: (x[:4], y[:4]),
        lambda x, y: (x[:9], y[:9]),
        lambda x, y: (x, np.full_like(y, 3.7)),
        lambda x, y: (x, y * 1e12),
        lambda x, y: (x, y * 1e-12 + 1.0e-9),
        lambda x, y: (x * 10.0 ** np.arange(-9, 9, 3), y),
        lambda x, y: (x[:, :1], y),
        lambda x, y: (np.repeat(x[:8], 4, axis=0), y),
        lambda x, y: (np.round(x), y),
        lambda x, y: (np.ones_like(x), y),
    ],
    ids=[
        "n=4",
        "n=9",
        "constant y",
        "y*1e12",
        "y*1e-12",
        "scales",
        "one column",
        "repeats",
        "two levels",
        "no spread",
    ],
)
def test_mess_is_taken_in(method, change):
    x, y = change(*data())
    screener = KrigingScreener(method=method).fit(x, y)
    assert sorted(screener.ranking_) == list(range(x.shape[1]))
    assert np.isfinite(screener.theta_).all()
    assert screener.diagnosis_.verdict


@pytest.mark.parametrize("categorical", [(), (3,)])
def test_a_rare_level_may_be_left_out_of_a_resample(categorical):
    rng = np.random.default_rng(0)
    x = np.c_[rng.random((20, 3)), np.arange(20) < 2]
    screener = KrigingScreener(categorical=categorical).fit(x, x[:, 0] + 5 * x[:, 3])
    assert list(screener.selected_) == [3, 0]
    assert selection_stability(screener, resamples=20, rng=rng)[0] == pytest.approx(1.0)


@pytest.mark.parametrize("method", METHODS)
def test_inputs_without_spread_are_not_blamed_on_the_response(method):
    diagnosis = KrigingScreener(method=method).fit(np.ones((20, 3)), np.arange(20.0)).diagnosis_
    assert diagnosis.verdict == "nothing to screen: no input varies"
    assert diagnosis.advice == "vary the inputs: each has the same value in all runs"


@pytest.mark.parametrize("method", ["forward", "welch"])
def test_a_pool_that_explains_all_is_not_called_noise(method):
    x = np.random.default_rng(0).random((40, 1))
    diagnosis = KrigingScreener(method=method).fit(x, np.sin(5 * x[:, 0])).diagnosis_
    assert diagnosis.verdict.startswith("not judged: one theta shared by all inputs raises l by 32")
    assert "method='default'" in diagnosis.advice
    noise = KrigingScreener(method=method).fit(x, np.random.default_rng(1).random(40)).diagnosis_
    assert noise.verdict == "not resolved: no input explains the response better than noise does"


@pytest.mark.parametrize("method", ["forward", "welch"])
@pytest.mark.parametrize("widths", [np.full(6, 1e9), np.full(6, 1e-9), 10.0 ** np.arange(-9, 9, 3)], ids=str)
def test_greedy_methods_do_not_depend_on_the_units(method, widths):
    x, y = data()
    box = (x - x.min(axis=0)) / np.ptp(x, axis=0)
    one, other = (KrigingScreener(method=method).fit(z, y) for z in (box, x * widths))
    assert list(one.selected_) == list(other.selected_)
    assert one.log_likelihood_ == pytest.approx(other.log_likelihood_, abs=1e-6)


def test_bad_input_is_refused_with_a_cure():
    x, y = data()
    broken = x.copy()
    broken[5, 2] = np.nan
    with pytest.raises(ValueError, match=r"X holds NaN in run 5 in column 2 .*leave failed runs out"):
        KrigingScreener().fit(broken, y)
    with pytest.raises(ValueError, match=r"y holds infinity in run 0"):
        KrigingScreener().fit(x, np.r_[np.inf, y[1:]])
    with pytest.raises(TooFewRuns, match=r"at least 3 runs, got n_samples = 2: add runs"):
        KrigingScreener().fit(x[:2], y[:2])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "best"}, "method needs one of default, forward, welch, got 'best'"),
        ({"criterion": "aic"}, "criterion needs 'reml' or 'ml', got 'aic'"),
        ({"eta": 3.0}, "eta needs a number with 1 <= eta <= 2, or None, got 3.0"),
        ({"eta": "free"}, "eta needs a number with 1 <= eta <= 2, or None, got 'free'"),
        ({"threshold": np.nan}, "threshold needs a number >= 0, or None, got nan"),
        ({"threshold": -1.0}, "threshold needs a number >= 0, or None, got -1.0"),
        ({"threshold": "auto"}, "threshold needs a number >= 0, or None, got 'auto'"),
        ({"n_features": 0}, "n_features needs at least 1, got 0"),
        ({"n_starts": 0}, "n_starts and enough need at least 1, got n_starts=0 and enough=8"),
        ({"nugget": 0.0}, r"nugget needs a positive number or a pair \(low, high\) with 0 < low .*got 0.0"),
        ({"nugget": (0.1, 0.01)}, r"nugget needs a positive number or a pair .*got \(0.1, 0.01\)"),
        ({"nugget": (0.1, None)}, r"nugget needs a positive number or a pair .*got \(0.1, None\)"),
        ({"nugget": [0.01, 0.1]}, r"nugget needs a positive number or a pair .*got \[0.01, 0.1\]"),
        ({"nugget": "estimate"}, r"nugget needs .*, or None to have it estimated, got 'estimate'"),
        ({"groups": [(0, 9)]}, "groups need columns 0 to 5, got 9"),
        ({"groups": [(0, 1), (1, 2)]}, "groups need each column at most once, got column 1 twice"),
    ],
)
def test_options_that_do_not_fit_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        KrigingScreener(**options).fit(*data())


def test_welch_names_its_limit():
    with pytest.raises(ValueError, match=r"cannot take 2000 runs of 20 inputs: use a part of the runs"):
        KrigingScreener(method="welch").fit(np.random.default_rng(0).random((2000, 20)), np.arange(2000.0))


def test_threshold_grows_with_the_number_of_inputs():
    values = [threshold_for(d) for d in (2, 8, 20, 50, 100, 400)]
    assert values[0] == pytest.approx(1.92, abs=1e-3)
    assert values == sorted(values)
