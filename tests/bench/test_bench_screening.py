"""Screening beside its rivals on the same runs: recovery of the active inputs and CPU seconds, one table
per question.

CPU seconds on one core with one BLAS thread; compare rows of one table only, machines and loads differ.
"""

import resource
import time
import warnings

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from studies.screening_functions import FUNCTIONS
from surrogates import KrigingScreener, morris_effects, morris_points, profiled_log_likelihood
from surrogates.canonical import canonical_runs
from surrogates.landscape import landscape_of

pytestmark = pytest.mark.bench

ACTIVE = FUNCTIONS["welch"].active
SEEDS = range(10)


def sample(n, d, seed, noise=0.0):
    """A shuffled random LHS of Welch's function and the places of its active inputs; beyond 20 all inputs
    are inert."""
    rng = np.random.default_rng(seed)
    x = (np.argsort(rng.random((d, n)), axis=1).T + rng.random((n, d))) / n
    y = FUNCTIONS["welch"].evaluate(x[:, :20])
    y = y + noise * y.std() * rng.standard_normal(n)
    order = rng.permutation(d)
    return x[:, order], y, {int(np.flatnonzero(order == k)[0]) for k in ACTIVE}


def row(name, rank, n, d, *, seeds=SEEDS, noise=0.0):
    seconds, hits, exact = [], [], 0
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # peers announce their troubles by warnings
        for seed in seeds:
            x, y, active = sample(n, d, seed, noise)
            start = time.process_time()
            ranking = rank(x, y)
            seconds.append(time.process_time() - start)
            found = len(set(ranking[:6]) & active)
            hits.append(found)
            exact += found == 6
    print(
        f"{name:42s} {n:5d} x {d:<4d} seeds {len(seconds):3d}   six first {exact / len(seconds):5.2f}"
        f"   hits {np.mean(hits):5.2f}   CPU s {np.median(seconds):8.3f}"
    )
    return np.median(seconds)


def ours(**options):
    def rank(x, y):
        return KrigingScreener(**options).fit(x, y).ranking_.tolist()

    rank(*sample(20, 20, 99)[:2])  # load and compile
    return rank


def scikit_learn(restarts):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel

    def rank(x, y):
        kernel = ConstantKernel(1.0, (1e-3, 1e5)) * RBF(np.ones(x.shape[1]), (1e-2, 1e3))
        model = GaussianProcessRegressor(
            kernel, alpha=1e-8, normalize_y=True, n_restarts_optimizer=restarts, random_state=0
        )
        return np.argsort(model.fit(x, y).kernel_.k2.length_scale).tolist()

    return rank


def smt(x, y):
    from smt.surrogate_models import KRG

    model = KRG(theta0=[1e-2] * x.shape[1], print_global=False)
    model.set_training_values(x, y)
    model.train()
    return np.argsort(-np.asarray(model.optimal_theta)).tolist()


def openturns(x, y):
    import openturns as ot

    d = x.shape[1]
    fitter = ot.GaussianProcessFitter(
        ot.Sample(x),
        ot.Sample(y[:, None]),
        ot.SquaredExponential([1.0] * d, [1.0]),
        ot.ConstantBasisFactory(d).build(),
    )
    fitter.run()
    return np.argsort(np.array(fitter.getResult().getCovarianceModel().getScale())).tolist()


def test_given_data_50_by_20():
    print()
    row("holdfast default", ours(), 50, 20)
    row("holdfast forward (as published)", ours(method="forward", n_features=6), 50, 20)
    row("scikit-learn RBF, 0 restarts", scikit_learn(0), 50, 20)
    row("scikit-learn RBF, 9 restarts", scikit_learn(9), 50, 20, seeds=range(5))
    pytest.importorskip("openturns")
    row("OpenTURNS GaussianProcessFitter", openturns, 50, 20, seeds=range(5))
    pytest.importorskip("smt")
    row("SMT KRG", smt, 50, 20, seeds=range(2))


def test_rivals_of_other_kinds_50_by_20():
    from surrogates.rivals import RIVALS

    print()
    for name in ("linear", "quadratic", "forest", "sobol"):

        def rank(x, y, name=name):
            return np.argsort(-RIVALS[name](x, y, np.random.default_rng(0))[0]).tolist()

        row(f"holdfast rival {name!r}", rank, 50, 20, seeds=range(5))


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_own_runs_beside_given_runs(noise):
    """Elementary effects choose their runs: 63 of them beside a screening of 64 given ones."""
    print()
    evaluate = FUNCTIONS["welch"].evaluate

    def own_runs(name, effects):
        exact = 0
        for seed in range(40):
            rng = np.random.default_rng(seed)
            x = morris_points(20, 3, rng=rng)
            y = evaluate(x)
            y = y + noise * 2.12 * rng.standard_normal(len(y))  # 2.12: standard deviation of the function
            exact += set(effects(x, y)[:6]) == set(ACTIVE)
        print(f"{name:42s} {63:5d} own runs, noise {noise:.0%}   seeds  40   six first {exact / 40:5.2f}")

    row(f"holdfast default, given LHS, noise {noise:.0%}", ours(), 64, 20, noise=noise)
    own_runs("holdfast Morris", lambda x, y: morris_effects(x, y).ranking.tolist())
    analyse = pytest.importorskip("SALib.analyze.morris")
    problem = {"num_vars": 20, "names": [str(i) for i in range(20)], "bounds": [[0, 1]] * 20}

    def salib(x, y):
        found = analyse.analyze(problem, x, y, num_levels=4)
        return np.argsort(-np.asarray(found["mu_star"])).tolist()

    own_runs("SALib Morris", salib)


def test_large_designs():
    print()
    row("holdfast default", ours(), 500, 100, seeds=range(3))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"peak memory of this process so far {peak:.0f} MB (interpreter and libraries included)")
    row("scikit-learn RBF, 0 restarts", scikit_learn(0), 500, 100, seeds=range(1))
    row("holdfast default", ours(), 2000, 100, seeds=range(1))


@pytest.mark.parametrize(("n", "d"), [(50, 20), (500, 100)])
def test_one_value_and_gradient(n, d):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF

    x, y, _ = sample(n, d, 0)
    phi = np.full(d, -1.0)
    ground = landscape_of(canonical_runs(x, y))
    times = 100 if n < 100 else 5

    def clocked(name, call):
        call()
        start = time.process_time()
        for _ in range(times):
            call()
        print(f"{name:42s} {n:5d} x {d:<4d} {(time.process_time() - start) / times * 1e3:9.3f} ms")

    print()
    with threadpool_limits(1):
        clocked("holdfast profiled_log_likelihood", lambda: profiled_log_likelihood(phi, x, y, nugget=1e-6))
        if n < 100:
            from surrogates._kernels_likelihood import likelihood

            out, none = np.zeros(d + 1), np.zeros((d + 1, d + 1))
            at = np.append(phi, np.log(1e-6))
            clocked(
                "holdfast compiled kernel",
                lambda: likelihood(ground.distances, ground.y, at, True, 1, out, none, -99.0),
            )
        model = GaussianProcessRegressor(RBF(np.ones(d)), optimizer=None, alpha=1e-6).fit(x, y)
        theta = model.kernel_.theta
        clocked(
            "scikit-learn log_marginal_likelihood",
            lambda: model.log_marginal_likelihood(theta, eval_gradient=True, clone_kernel=False),
        )
