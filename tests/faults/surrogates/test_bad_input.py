"""Bad input: an answer with a diagnosis, or an error that says what to do. Warnings are errors in this
suite."""

import numpy as np
import pandas as pd
import pytest

from surrogates import Kriging, KrigingScreener, NotPositiveDefinite, TooFewRuns, sobol_indices
from tests.plain_kriging import plain

NO_SHARE = 1e-3  # the weights of the runs are large and of both signs: their rounding shows

RNG = np.random.default_rng(0)
X = RNG.random((25, 3))
Y = np.sin(4 * X[:, 0]) + X[:, 1] * X[:, 2]
SETTINGS = [
    {},
    {"nugget": "estimate"},
    {"correlation": "matern52"},
    {"criterion": "ml"},
    {"trend": "linear", "intervals": "calibrated"},
    {"correlation": "power_exponential", "nugget": "ladder", "n_starts": 2},
]
CASES = {
    "equal duplicates": (np.r_[X, X[:3]], np.r_[Y, Y[:3]]),
    "unequal duplicates": (np.r_[X, X[:3]], np.r_[Y, Y[:3] + 0.3]),
    "near duplicates": (np.r_[X, X[:1] + 1e-12], np.r_[Y, Y[:1] + 1e-3]),
    "constant column": (np.c_[X, np.full(25, 3.0)], Y),
    "repeated column": (np.c_[X, X[:, 0]], Y),
    "mirrored column": (np.c_[X, 1 - X[:, 0]], Y),
    "five runs": (X[:5], Y[:5]),
    "constant response": (X, np.full(25, 7.0)),
    "zero response": (X, np.zeros(25)),
    "response x 1e12": (X, 1e12 * Y),
    "response x 1e-12": (X, 1e-12 * Y),
    "response x 1e-200": (X, 1e-200 * Y),
    "input x 1e9": (X * [1e9, 1, 1], Y),
    "input x 1e-9": (X * [1e-9, 1, 1], Y),
    "shifted input": (X + 1e6, Y),
    "shifted response": (X, Y + 1e9),
    "one column": (X[:, :1], Y),
    "all runs equal": (np.ones((25, 3)), Y),
    "levels": (RNG.integers(0, 2, (25, 3)), Y),
    "linear response": (X, X @ [1.0, 2.0, 3.0]),
}


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
@pytest.mark.parametrize("case", CASES)
def test_an_answer_with_a_diagnosis(case, settings):
    x, y = CASES[case]
    k = plain(**settings).fit(x, y)
    mean, std = k.predict(x, return_std=True)
    assert np.isfinite(mean).all()
    assert np.isfinite(std).all()
    assert (std >= 0).all()
    assert k.diagnosis_.advice.endswith(".")
    assert np.isfinite(k.leave_one_out().prediction).all()


@pytest.mark.parametrize("n", [2, 3])
def test_two_and_three_runs(n):
    k = plain().fit(X[:n], Y[:n])
    assert np.abs(k.predict(X[:n]) - Y[:n]).max() < 1e-3
    assert "Q2" in k.diagnosis_.advice


def test_fewer_runs_than_inputs():
    k = plain().fit(RNG.random((6, 10)), RNG.random(6))
    assert k.theta_.shape == (10,)


@pytest.mark.parametrize(
    ("case", "words"),
    [
        (
            "unequal duplicates",
            "runs 0 and 25 have equal inputs and different responses: set nugget='estimate'",
        ),
        ("constant column", "input 3 never changes"),
        ("repeated column", "inputs 0 and 3 carry the same values"),
        ("mirrored column", "inputs 0 and 3 carry the same values"),
        ("constant response", "the trend alone reproduces every response"),
    ],
)
def test_the_advice_says_it(case, words):
    x, y = CASES[case]
    assert words.lower() in plain(nugget=1e-8).fit(x, y).diagnosis_.advice.lower()


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
@pytest.mark.parametrize("last", [0.3, 0.1 + 0.2], ids=["equal", "up to rounding"])
def test_a_constant_column_takes_no_part(settings, last):
    still = np.r_[np.full(24, 0.3), last]
    k = plain(**settings).fit(np.c_[X, still], Y)
    assert k.theta_[3] == 0.0
    assert 3 not in k.diagnosis_.at_upper_bound
    points = np.random.default_rng(1).random((9, 3))
    here, far = (k.predict(np.c_[points, np.full(9, v)], return_std=True) for v in (0.3, -40.0))
    assert np.array_equal(here, far)
    assert sobol_indices(k, draws=4, rng=np.random.default_rng(0)).total.upper[3] < NO_SHARE


@pytest.mark.parametrize(
    "settings", [{"theta_bounds": (0.5, 8.0)}, {"groups": [0, 1, 1, 1]}, {"categorical": [3]}]
)
def test_a_constant_column_takes_no_part_whatever_else_is_asked(settings):
    k = plain(**settings).fit(np.c_[X, np.ones(25)], Y)
    assert k.theta_[3] == 0.0
    assert (k.theta_[:3] > 0.0).all()


def test_a_fixed_theta_is_left_as_given():
    assert plain(theta=[1.0, 2.0, 3.0, 4.0]).fit(np.c_[X, np.ones(25)], Y).theta_[3] == 4.0


@pytest.mark.parametrize("n", [8, 12, 20])
def test_leave_one_out_of_few_runs_is_called_flattering(n):
    rng = np.random.default_rng(n)
    x = np.c_[rng.random((n, 10)), np.ones(n)]
    k = plain().fit(x, np.sin(4 * x[:, 0]) + x[:, 1] * x[:, 2])
    said = f"{n} runs are few for 10 thetas that were fitted to them, so leave-one-out flatters"
    assert said in k.diagnosis_.advice
    assert "come to 30 runs, screen the inputs first" in k.diagnosis_.advice


def test_leave_one_out_is_not_doubted_where_nothing_was_fitted_or_the_runs_are_enough():
    assert "flatters" not in plain().fit(X, Y).diagnosis_.advice
    assert "flatters" not in plain(theta=1.0).fit(X[:5], Y[:5]).diagnosis_.advice


def test_pure_noise_is_not_trusted():
    k = plain().fit(X, np.random.default_rng(3).normal(size=25))
    assert k.diagnosis_.q2 < 0.5
    assert "do not rely on predictions" in k.diagnosis_.advice


def test_equal_runs_without_nugget_are_named():
    x, y = CASES["unequal duplicates"]
    with pytest.raises(
        NotPositiveDefinite, match=r"runs run0 and run25 are 0 apart .* Remove one, or set nugget=1e-08"
    ):
        plain(nugget=0.0).fit(x, y, run_ids=[f"run{i}" for i in range(28)])
    with pytest.raises(np.linalg.LinAlgError, match="runs 0 and 25"):
        plain(nugget=0.0, theta=1.0).fit(x, y)


@pytest.mark.parametrize(
    ("row", "value", "message"),
    [
        (
            4,
            np.nan,
            r"X holds NaN in run 4 in column 1 \(1 of 25 runs are not finite\): leave failed runs out",
        ),
        (0, -np.inf, "X holds infinity in run 0 in column 1"),
    ],
)
def test_the_row_that_is_not_finite_is_named(row, value, message):
    x = X.copy()
    x[row, 1] = value
    with pytest.raises(ValueError, match=message):
        plain().fit(x, Y)


def test_the_run_id_of_a_failed_run_is_named():
    y = Y.copy()
    y[7] = np.nan
    with pytest.raises(ValueError, match=r"y holds NaN in run r7 \(1 of 25"):
        plain().fit(X, y, run_ids=[f"r{i}" for i in range(25)])


@pytest.mark.parametrize("estimator", [Kriging, KrigingScreener])
@pytest.mark.parametrize("container", [np.array, list, tuple, pd.Series], ids=lambda c: c.__name__)
@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.nan, r"y holds NaN in run 7 \(1 of 25 runs are not finite\): leave failed runs out"),
        (-np.inf, "y holds infinity in run 7"),
        ("crash", "y holds 'crash' in run 7, not a number: leave failed runs out"),
        (None, r"y holds (None|NaN) in run 7"),
    ],
)
def test_the_run_without_a_response_is_named(estimator, container, value, message):
    y = Y.tolist()
    y[7] = value
    with pytest.raises(ValueError, match=message):
        estimator().fit(X, container(y))
    with pytest.raises(ValueError, match=message):
        estimator().fit(pd.DataFrame(X, columns=list("abc")), container(y))


@pytest.mark.parametrize("estimator", [Kriging, KrigingScreener])
def test_a_response_whose_variance_overflows_is_refused(estimator):
    estimator().fit(X, 1e149 * Y)
    for size in (1e151, 1e155, -1e308):
        with pytest.raises(
            ValueError, match=r"y holds a number of the size .* in run \d+, whose variance overflows"
        ):
            estimator().fit(X, size * Y)


@pytest.mark.parametrize("estimator", [Kriging, KrigingScreener])
@pytest.mark.parametrize("missing", [None, np.nan, np.inf, np.float32("nan"), pd.NA, pd.NaT], ids=repr)
def test_what_is_missing_is_no_label(estimator, missing):
    x = X.astype(object)
    x[:, 2] = np.where(X[:, 2] > 0.5, "oak", "ash")
    fitted = estimator(categorical=[2]).fit(x, Y)
    x[4, 2] = missing
    message = (
        "column 2 holds .* in run 4 where a label should be: leave the run out, or give what is missing a"
    )
    for given in (x, pd.DataFrame(x)):
        with pytest.raises(ValueError, match=message):
            estimator(categorical=[-1]).fit(given, Y)
    with pytest.raises(ValueError, match=message):
        fitted.predict(x) if estimator is Kriging else fitted.transform(x)


@pytest.mark.parametrize("estimator", [Kriging, KrigingScreener])
def test_labels_in_a_table_keep_the_names_of_its_columns(estimator):
    table = pd.DataFrame(X, columns=["force", "length", "wood"])
    table["wood"] = np.where(X[:, 2] > 0.5, "oak", "ash")
    fitted = estimator(categorical=[2]).fit(table, Y)
    assert fitted.feature_names_in_.tolist() == ["force", "length", "wood"]
    plain = estimator(categorical=[2]).fit(table.to_numpy(dtype=object), Y)
    if estimator is Kriging:
        assert np.array_equal(fitted.predict(table), plain.predict(table.to_numpy(dtype=object)))
        with pytest.raises(ValueError, match="feature names should match"):
            fitted.predict(table.rename(columns={"force": "mass"}))
    else:
        assert set(fitted.get_feature_names_out()) <= {"force", "length", "wood"}
        assert fitted.log_likelihood_ == plain.log_likelihood_


@pytest.mark.parametrize("estimator", [Kriging, KrigingScreener])
@pytest.mark.parametrize("column", ["wood", 1.0, True, None], ids=repr)
def test_label_columns_are_numbers(estimator, column):
    with pytest.raises(ValueError, match=f"categorical needs column numbers from 0 to 2, got {column!r}"):
        estimator(categorical=[column]).fit(X, Y)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"criterion": "map"}, "criterion needs 'reml' or 'ml', got 'map'"),
        (
            {"trend": "cubic"},
            "trend needs one of auto, constant, linear, interactions, quadratic or a function",
        ),
        ({"correlation": "rbf"}, "correlation needs one of auto, gaussian, power_exponential"),
        ({"nugget": -1}, "nugget needs a number >= 0 or one of auto, estimate, ladder, got -1"),
        ({"nugget": [1e-4, 1e-2]}, r"nugget needs a number >= 0 or one of .*, got \[0.0001, 0.01\]"),
        ({"nugget": None}, "nugget needs a number >= 0 or one of .*, got None"),
        ({"eta": None}, r"eta needs a number in \[1, 2\] or 'free', got None"),
        ({"nugget": "free"}, "nugget needs a number or one of auto, estimate, ladder, got 'free'"),
        ({"eta": 2.5}, r"eta needs a number in \[1, 2\] or 'free', got 2.5"),
        ({"eta": "any"}, r"eta needs a number in \[1, 2\] or 'free', got 'any'"),
        ({"intervals": "yes"}, "intervals needs 'calibrated' or 'plug-in', got 'yes'"),
        ({"n_starts": 0}, "n_starts needs a whole number >= 1, got 0"),
        ({"theta": [1.0, 2.0]}, "theta needs 3 finite numbers >= 0"),
        ({"theta_start": [-1.0, 1, 1]}, "theta_start needs 3 finite numbers >= 0"),
        ({"theta_bounds": (2, 1)}, "theta_bounds needs 0 < low <= high"),
        ({"theta_bounds": [1, 2, 3]}, r"theta_bounds needs \(low, high\) or shape \(3, 2\)"),
        ({"theta_prior": (1.0, 0.0)}, r"theta_prior needs \(median, deviation of log theta\) > 0, got \(1.0"),
        ({"groups": [1]}, "groups needs one label per input, got 1 for 3 inputs"),
        ({"categorical": [5]}, "categorical needs columns below 3, got 5"),
        ({"trend": np.ravel}, r"trend function needs to return an array of shape \(25, p\)"),
        ({"trend": lambda x: x * np.nan}, "trend function needs to return finite numbers"),
    ],
)
def test_settings_that_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        plain(**settings).fit(X, Y)


def test_runs_that_are_refused():
    with pytest.raises(TooFewRuns, match="at least 2 runs, got n_samples = 1: add runs"):
        plain().fit(X[:1], Y[:1])
    with pytest.raises(TooFewRuns, match="at least 2 runs, got n_samples = 0: add runs"):
        plain().fit(X[:0], Y[:0])
    with pytest.raises(TooFewRuns, match="at least 3 runs, got n_samples = 0: add runs"):
        KrigingScreener().fit(X[:0], Y[:0])
    with pytest.raises(TooFewRuns, match="trend 'quadratic' has 10 terms and needs at least 11 runs, got 10"):
        plain(trend="quadratic").fit(X[:10], Y[:10])
    with pytest.raises(ValueError, match="run_ids needs one entry per run, got 2 for 25 runs"):
        plain().fit(X, Y, run_ids=[1, 2])
    with pytest.raises(ValueError, match="noise needs variances >= 0"):
        plain().fit(X, Y, noise=-np.ones(25))
    text = np.array([["1.5", "red"], ["2.5", "blue"], ["3.0", "red"]], dtype=object)
    with pytest.raises(
        ValueError, match=r"column 1 holds text \('red' in row 0\): name it in categorical=\[1\]"
    ):
        plain().fit(text, [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="column 1 holds text"):
        plain(categorical=[0]).fit(text, [1.0, 2.0, 3.0])
    plain(categorical=[1]).fit(text, [1.0, 2.0, 3.0])
