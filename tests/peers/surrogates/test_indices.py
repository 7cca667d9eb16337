"""Regression coefficients and HSIC beside OpenTURNS."""

import numpy as np
import pytest

from surrogates import hsic_indices, regression_coefficients

pytestmark = pytest.mark.peer

ot = pytest.importorskip("openturns")


def runs():
    x = np.random.default_rng(5).random((80, 3))
    return x, np.sin(4 * x[:, 0]) + x[:, 1] ** 2 + 0.1 * x[:, 2]


@pytest.mark.parametrize("kind", ["src", "srrc", "pcc", "prcc"])
def test_coefficients(kind):
    x, y = runs()
    analysis = ot.CorrelationAnalysis(ot.Sample(x), ot.Sample(y[:, None]))
    theirs = np.array(getattr(analysis, f"compute{kind.upper()}")())
    ours = regression_coefficients(x, y, kind=kind, resamples=2, rng=np.random.default_rng(0))
    assert ours.value == pytest.approx(theirs, abs=1e-10)


def test_hsic():
    x, y = runs()
    columns = [*x.T, y]
    kernels = [ot.SquaredExponential([float(column.std())], [1.0]) for column in columns]
    estimator = ot.HSICEstimatorGlobalSensitivity(
        kernels, ot.Sample(x), ot.Sample(y[:, None]), ot.HSICVStat()
    )
    ours = hsic_indices(x, y, permutations=10, rng=np.random.default_rng(0))
    assert ours.r2 == pytest.approx(np.array(estimator.getR2HSICIndices()), rel=1e-6)
    assert ours.hsic == pytest.approx(np.array(estimator.getHSICIndices()), rel=1e-6)
