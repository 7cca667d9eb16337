"""HSIC beside its sums written out, the level and power of its test, labels."""

import numpy as np
import pytest

from surrogates import TooFewRuns, hsic_indices


def written_out(a, b):
    """tr(K H L H)/n^2 with loops."""
    n = len(a)
    k = np.array([[np.exp(-0.5 * ((p - q) / a.std()) ** 2) for p in a] for q in a])
    m = np.array([[np.exp(-0.5 * ((p - q) / b.std()) ** 2) for p in b] for q in b])
    return (k * m).mean() + k.mean() * m.mean() - 2 * (k.mean(axis=1) * m.mean(axis=1)).sum() / n


def test_hsic_is_the_sum_of_its_definition():
    rng = np.random.default_rng(0)
    x = rng.random((25, 2))
    y = np.cos(5 * x[:, 0]) + 0.1 * rng.random(25)
    found = hsic_indices(x, y, permutations=10, rng=rng)
    assert found.hsic == pytest.approx([written_out(x[:, 0], y), written_out(x[:, 1], y)], rel=1e-10)
    scale = np.sqrt(written_out(x[:, 0], x[:, 0]) * written_out(y, y))
    assert found.r2[0] == pytest.approx(written_out(x[:, 0], y) / scale, rel=1e-10)


def test_it_sees_a_bowl_and_the_test_keeps_its_level():
    """A bowl has no correlation. 40 samples of 40 runs; independent inputs below 0.05 in one of twenty."""
    seen, false = 0, 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        x = rng.random((40, 3))
        found = hsic_indices(x, (x[:, 0] - 0.5) ** 2, permutations=100, rng=rng)
        seen += found.p_value[0] < 0.05
        false += int((found.p_value[1:] < 0.05).sum())
    assert seen == 40
    assert false <= 10  # of 80, 4 expected; 10 and more have a chance of 0.6 %


def test_a_column_against_itself_has_one_and_a_constant_none():
    x = np.random.default_rng(1).random((30, 2))
    x[:, 1] = 4.0
    found = hsic_indices(x, x[:, 0], permutations=50, rng=np.random.default_rng(0))
    assert found.r2 == pytest.approx([1.0, 0.0])
    assert found.p_value == pytest.approx([1 / 51, 1.0])


def test_labels_have_no_order():
    rng = np.random.default_rng(2)
    label = rng.integers(0, 4, 60)
    y = np.array([0.0, 3.0, 1.0, 2.0])[label]
    x = np.column_stack([label, rng.random(60)])
    found = hsic_indices(x, y, categorical=[0], permutations=100, rng=np.random.default_rng(0))
    again = hsic_indices(
        np.column_stack([(label * 7) % 5, x[:, 1]]),
        y,
        categorical=[0],
        permutations=100,
        rng=np.random.default_rng(0),
    )
    assert found.r2 == pytest.approx(again.r2)
    assert found.p_value[0] < 0.02


@pytest.mark.parametrize(
    ("x", "y", "settings", "error", "message"),
    [
        (np.ones((3, 2)), np.arange(3.0), {}, TooFewRuns, "HSIC needs at least 5 runs, got 3"),
        (np.ones((6, 2)), np.arange(5.0), {}, ValueError, r"got shapes \(6, 2\) and \(5,\)"),
        (np.ones((6, 2)), np.full(6, np.nan), {}, ValueError, "HSIC needs finite runs"),
        (np.ones((6, 2)), np.ones(6), {}, ValueError, "a response that varies"),
        (np.ones((6, 2)), np.arange(6.0), {"categorical": [2]}, ValueError, "columns below 2, got 2"),
    ],
)
def test_runs_that_are_refused(x, y, settings, error, message):
    with pytest.raises(error, match=message):
        hsic_indices(x, y, rng=np.random.default_rng(0), **settings)
