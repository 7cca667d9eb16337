"""Fits of one Kriging model beside scikit-learn, SMT and OpenTURNS: CPU seconds, Q2 on new points, memory."""

import time
import tracemalloc

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from tests.plain_kriging import plain

pytestmark = pytest.mark.bench


def runs(n, d, seed=0):
    """A response with six active inputs of d, and 500 new points."""
    rng = np.random.default_rng(seed)
    x = rng.random((n + 500, d))
    z = x[:, rng.permutation(d)[:6]] - 0.5
    y = 5 * z[:, 1] / (1 + z[:, 0]) + 5 * (z[:, 2] - z[:, 3]) ** 2 + z[:, 4] + 40 * z[:, 5] ** 3 - 5 * z[:, 5]
    return x[:n], y[:n], x[n:], y[n:]


def clocked(name, fit, predict, x, y, new, truth):
    with threadpool_limits(1):
        start = time.process_time()
        model = fit(x, y)
        seconds = time.process_time() - start
    error = np.mean((predict(model, new) - truth) ** 2) / truth.var()
    print(
        f"{name:34s} {len(x):5d} x {x.shape[1]:<4d} {seconds:9.3f} CPU s   Q2 on new points {1 - error:7.4f}"
    )
    return seconds


def ours(x, y, new, truth, **settings):
    plain(**settings).fit(x[:20], y[:20])  # load and compile
    name = "holdfast " + " ".join(str(v) for v in settings.values())
    return clocked(name, plain(**settings).fit, lambda m, p: m.predict(p), x, y, new, truth)


def sklearn_fit(x, y, new, truth, restarts=0):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel

    kernel = ConstantKernel(1.0, (1e-3, 1e5)) * RBF(np.ones(x.shape[1]), (1e-2, 1e3))
    model = GaussianProcessRegressor(kernel, alpha=1e-8, normalize_y=True, n_restarts_optimizer=restarts)
    name = f"scikit-learn RBF, {restarts} restarts"
    clocked(name, model.fit, lambda m, p: m.predict(p), x, y, new, truth)


def openturns_fit(x, y, new, truth):
    ot = pytest.importorskip("openturns")

    def fit(x, y):
        d = x.shape[1]
        kernel = ot.SquaredExponential([1.0] * d, [1.0])
        basis = ot.ConstantBasisFactory(d).build()
        fitter = ot.GaussianProcessFitter(ot.Sample(x), ot.Sample(y[:, None]), kernel, basis)
        fitter.run()
        regression = ot.GaussianProcessRegression(fitter.getResult())
        regression.run()
        return regression.getResult().getMetaModel()

    clocked("OpenTURNS", fit, lambda m, p: np.array(m(ot.Sample(p)))[:, 0], x, y, new, truth)


def smt_fit(x, y, new, truth):
    surrogate = pytest.importorskip("smt.surrogate_models")

    def fit(x, y):
        model = surrogate.KRG(print_global=False)
        model.set_training_values(x, y)
        model.train()
        return model

    clocked("SMT KRG", fit, lambda m, p: m.predict_values(p)[:, 0], x, y, new, truth)


@pytest.mark.filterwarnings("ignore")
def test_50_by_20():
    data = runs(50, 20)
    print()
    ours(*data)
    ours(*data, correlation="matern52")
    ours(*data, correlation="auto", trend="auto", intervals="calibrated")  # as imported
    sklearn_fit(*data)
    sklearn_fit(*data, restarts=4)
    openturns_fit(*data)
    smt_fit(*data)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.timeout(900)
def test_500_by_100():
    data = runs(500, 100)
    print()
    ours(*data)
    ours(*data, correlation="matern52")
    ours(*data, correlation="auto", trend="auto", intervals="calibrated")  # as imported
    sklearn_fit(*data)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.timeout(900)
def test_2000_by_100():
    x, y, new, truth = runs(2000, 100)
    print()
    ours(x, y, new, truth)
    tracemalloc.start()
    plain(theta=plain().fit(x[:200], y[:200]).theta_).fit(x, y)
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    print(f"{'peak of arrays at given theta':34s}  2000 x 100  {peak:9.0f} MB")


@pytest.mark.filterwarnings("ignore")
def test_30_by_8_in_a_loop():
    x, y, new, truth = runs(30, 8)
    print()
    theta = plain(correlation="matern52", trend="linear").fit(x, y).theta_
    ours(x, y, new, truth, correlation="matern52", trend="linear")
    ours(x, y, new, truth, correlation="matern52", trend="linear", theta_start=1.3 * theta, n_starts=1)
