"""SRC, SRRC, PCC and PRCC beside their definitions by residuals, and closed forms."""

import numpy as np
import pytest
from scipy.stats import rankdata

from surrogates import TooFewRuns, regression_coefficients


def runs(n=120, seed=0):
    x = np.random.default_rng(seed).random((n, 4))
    return x, 3 * x[:, 0] - 2 * x[:, 1] ** 3 + x[:, 0] * x[:, 2]


def residual(column, others):
    design = np.column_stack([np.ones(len(column)), others])
    return column - design @ np.linalg.lstsq(design, column, rcond=None)[0]


@pytest.mark.parametrize("kind", ["src", "srrc", "pcc", "prcc"])
def test_coefficients_are_those_of_the_definition(kind):
    x, y = runs()
    found = regression_coefficients(x, y, kind=kind, resamples=50, rng=np.random.default_rng(1))
    if "rr" in kind or kind == "prcc":
        x, y = rankdata(x, axis=0), rankdata(y)
    if kind in ("src", "srrc"):
        design = np.column_stack([np.ones(len(y)), x])
        b = np.linalg.lstsq(design, y, rcond=None)[0]
        expected = b[1:] * x.std(axis=0) / y.std()
    else:
        expected = [
            np.corrcoef(residual(x[:, k], np.delete(x, k, axis=1)), residual(y, np.delete(x, k, axis=1)))[
                0, 1
            ]
            for k in range(4)
        ]
    assert found.value == pytest.approx(expected, abs=1e-10)
    rest = residual(y, x)
    assert found.r2 == pytest.approx(1 - rest.var() / y.var(), abs=1e-10)
    assert found.ranking[:2].tolist() == np.argsort(-np.abs(np.array(expected)))[:2].tolist()


@pytest.mark.slow
def test_bands_hold_the_coefficients_of_the_law():
    """y = 2 x1 + x2 + noise with unit variances: src = (2, 1, 0)/sqrt(6); 60 samples of 60 runs."""
    held = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        x = rng.standard_normal((60, 3))
        y = 2 * x[:, 0] + x[:, 1] + rng.standard_normal(60)
        found = regression_coefficients(x, y, resamples=200, rng=rng)
        true = np.array([2, 1, 0]) / np.sqrt(6)
        held.append((found.lower <= true) & (true <= found.upper))
    share = np.mean(held)
    assert 0.95 - 3 * np.sqrt(0.95 * 0.05 / 180) < share < 1.0


def test_ranks_see_what_is_monotone_and_nothing_else():
    x = np.random.default_rng(3).random((200, 2))
    steep = np.exp(12 * x[:, 0])
    by_rank = regression_coefficients(x, steep, kind="srrc", resamples=10, rng=np.random.default_rng(0))
    by_value = regression_coefficients(x, steep, kind="src", resamples=10, rng=np.random.default_rng(0))
    assert by_rank.value[0] == pytest.approx(1.0, abs=1e-6)
    assert by_rank.r2 == pytest.approx(1.0, abs=1e-6)
    assert by_value.r2 < 0.6
    bowl = regression_coefficients(x, (x[:, 0] - 0.5) ** 2, kind="prcc", rng=np.random.default_rng(0))
    assert bowl.lower[0] < 0.0 < bowl.upper[0]


def test_an_input_that_never_changes_has_none():
    x, y = runs()
    x[:, 3] = 2.0
    found = regression_coefficients(x, y, resamples=10, rng=np.random.default_rng(0))
    assert (found.value[3], found.lower[3], found.upper[3]) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (lambda x, y: (x, y, "lasso"), ValueError, "kind needs one of src, srrc, pcc, prcc, got 'lasso'"),
        (lambda x, y: (x[:7], y[:7], "src"), TooFewRuns, "4 coefficients need at least 8 runs, got 7"),
        (lambda x, y: (x[:9], y[:8], "src"), ValueError, r"got shapes \(9, 4\) and \(8,\)"),
        (lambda x, y: (x, y * np.nan, "src"), ValueError, "coefficients need finite runs"),
        (lambda x, y: (x, y * 0, "src"), ValueError, "an input and a response that vary"),
        (lambda x, y: (x[:, [0, 1, 1]], y, "src"), ValueError, "repeat another in all runs"),
    ],
)
def test_runs_that_are_refused(change, error, message):
    x, y, kind = change(*runs())
    with pytest.raises(error, match=message):
        regression_coefficients(x, y, kind=kind, rng=np.random.default_rng(0))
