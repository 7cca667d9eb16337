"""A process with slopes: it goes through values and slopes, and is sure where it knows."""

import numpy as np
import pytest

from workbench.engine.layout.whole.sloped_process import SlopedProcess


def waves(points):
    """Two outputs of two features, and their slopes (n, 2, 2), feature by output."""
    x, y = points.T
    values = np.column_stack([np.sin(x) * np.cos(y), x * y])
    slopes = np.stack([
        np.column_stack([np.cos(x) * np.cos(y), y]), np.column_stack([-np.sin(x) * np.sin(y), x])
    ], axis=1)  # fmt: skip
    return values, slopes


def process(points, sloped, noise=1e-10):
    values, slopes = waves(points)
    return SlopedProcess(points, sloped, values, slopes[sloped], noise=noise)


def test_it_goes_through_values_and_slopes():
    points = np.random.default_rng(0).uniform(-1, 1, (9, 2))
    sloped = np.array([0, 3, 5])
    fit = process(points, sloped)
    values, slopes = waves(points)
    assert fit.mean(points) == pytest.approx(values, abs=1e-6)
    for feature in range(2):
        step = np.zeros(2)
        step[feature] = 1e-5
        found = (fit.mean(points[sloped] + step) - fit.mean(points[sloped] - step)) / 2e-5
        assert found == pytest.approx(slopes[sloped, feature], abs=1e-4)


def test_slopes_bring_it_nearer_and_make_it_surer():
    rng = np.random.default_rng(1)
    points, others = rng.uniform(-1, 1, (12, 2)), rng.uniform(-1, 1, (50, 2))
    with_slopes, without = process(points, np.arange(12)), process(points, np.zeros(0, dtype=int))
    truth = waves(others)[0]
    assert np.abs(with_slopes.mean(others) - truth).mean() < 0.5 * np.abs(without.mean(others) - truth).mean()
    assert (with_slopes.variance(others) <= without.variance(others) + 1e-9).all()
    assert with_slopes.variance(points).max() < 1e-6
    assert without.variance(np.full((1, 2), 50.0)) == pytest.approx(1.0)
