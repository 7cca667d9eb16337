"""Screening beside its rivals on the same runs: recovery of the active inputs and CPU seconds, one table
per question.

CPU seconds on one core with one BLAS thread; compare rows of one table only, machines and loads differ.
"""

import importlib.util
import resource
import time
import warnings

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from studies.screening_functions import FUNCTIONS
from surrogates import KrigingScreener, morris_effects, morris_points, profiled_log_likelihood
from surrogates.screening.partitions.canonical import canonical_runs
from surrogates.screening.partitions.landscape import landscape_of
from surrogates.screening.partitions.optimum import HIGHEST, LOWEST
from surrogates.screening.sets.backward import alone
from surrogates.screening.sets.multi_start import ALIVE

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
        f"   hits {np.mean(hits):5.2f}"
        f"   CPU s {np.median(seconds):8.3f} ({min(seconds):.3f} to {max(seconds):.3f})"
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
    return np.argsort(-smt_model(x, y).optimal_theta).tolist()


def smt_model(x, y):
    from smt.surrogate_models import KRG

    model = KRG(theta0=[1e-2] * x.shape[1], print_global=False)
    model.set_training_values(x, y)
    model.train()
    return model


def smt_theta(x, y):
    """Its theta per unit of x squared: it divides each input by its standard deviation.
    `tests/peers/surrogates/test_smt.py` shows that both likelihoods agree at such a theta."""
    model = smt_model(x, y)
    return np.asarray(model.optimal_theta) / np.ravel(model.X_scale) ** 2


def openturns(x, y):
    return np.argsort(openturns_scale(x, y)).tolist()


def openturns_scale(x, y):
    import openturns as ot

    d = x.shape[1]
    fitter = ot.GaussianProcessFitter(
        ot.Sample(x),
        ot.Sample(y[:, None]),
        ot.SquaredExponential([1.0] * d, [1.0]),
        ot.ConstantBasisFactory(d).build(),
    )
    fitter.run()
    return np.array(fitter.getResult().getCovarianceModel().getScale())


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
    from surrogates.screening.rivals import RIVALS

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


def penalised(screener, x, y, theta):
    """l - threshold x (inputs alive) of a peer's theta (d,), at the best nugget the screener may take, and of
    the screener itself."""
    runs = canonical_runs(x, y)
    ground = landscape_of(runs)
    facts = screener.diagnosis_
    everyone = tuple((u,) for u in range(ground.n_units))
    with np.errstate(divide="ignore"):
        phi = np.clip(np.log(theta[runs.columns] * runs.span**2), LOWEST, HIGHEST)
    low, high = np.log(facts.nugget_bounds)
    best = max(ground.value(everyone, np.append(phi, g)) for g in np.linspace(low, high, 40))
    alive = int((phi + np.log(ground.reach) > ALIVE).sum())
    ours = screener.log_likelihood_ + (len(y) - 1) * np.log(runs.scale)
    return best - facts.threshold * alive, ours - facts.threshold * len(screener.selected_)


def true_set(screener, x, y, active):
    """Maximum for the active inputs from six starts, penalised alike."""
    runs = canonical_runs(x, y)
    ground = landscape_of(runs)
    place = {int(k): u for u, k in enumerate(runs.columns)}
    units = tuple(place[k] for k in sorted(active))
    bounds = screener.diagnosis_.nugget_bounds
    ends = [
        ground.climb(
            alone(units),
            np.array([*[own] * len(units), np.log(bounds[0])]),
            nugget=bounds,
            tolerance=1e-4,
            max_evaluations=100,
        ).value
        for own in (-4.0, -3.0, -2.0, -1.0, 0.0, 1.0)
    ]
    return max(ends) - screener.diagnosis_.threshold * len(units)


SMT_BEFORE = 105  # its fits take a hundred times as long as ours


@pytest.mark.parametrize("n", [40, 50, 64])
def test_likelihood_reached(n):
    """Is there a set, or a fit by a peer, that the search should have found instead?"""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel

    lower = {"the true set": [], "scikit-learn, 2 restarts": [], "OpenTURNS": [], "SMT KRG": []}
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for seed in range(100, 125):
            x, y, active = sample(n, 20, seed)
            screener = KrigingScreener().fit(x, y)
            kernel = ConstantKernel(1.0, (1e-3, 1e5)) * RBF(np.ones(20), (1e-2, 1e3))
            model = GaussianProcessRegressor(
                kernel, alpha=1e-4, normalize_y=True, n_restarts_optimizer=2, random_state=0
            ).fit(x, y)
            theta = {"scikit-learn, 2 restarts": 0.5 / model.kernel_.k2.length_scale**2}
            if importlib.util.find_spec("openturns"):
                theta["OpenTURNS"] = 0.5 / openturns_scale(x, y) ** 2
            if importlib.util.find_spec("smt") and seed < SMT_BEFORE:
                theta["SMT KRG"] = smt_theta(x, y)
            _, ours = penalised(screener, x, y, np.zeros(20))
            lower["the true set"].append(true_set(screener, x, y, active) - ours)
            for name, value in theta.items():
                lower[name].append(penalised(screener, x, y, value)[0] - ours)
    print()
    for name, gaps in lower.items():
        if gaps:
            fell = int(np.sum(np.array(gaps) > 0.01))
            print(
                f"{name:28s} {n:4d} x 20   better by more than 0.01 on {fell:3d} of {len(gaps)} seeds, "
                f"at most {max(gaps):8.2f}, median {np.median(gaps):8.2f}"
            )


def test_large_designs():
    print()
    ours_seconds = row("holdfast default", ours(), 500, 100, seeds=range(8))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"peak memory of this process so far {peak:.0f} MB (interpreter and libraries included)")
    theirs = row("scikit-learn RBF, 0 restarts", scikit_learn(0), 500, 100, seeds=range(1))
    print(f"a single fit of scikit-learn takes {theirs / ours_seconds:.1f} times as long")
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
            from surrogates.likelihood._kernels_likelihood import likelihood

            out, none = np.zeros(d + 1), np.zeros((d + 1, d + 1))
            at = np.append(phi, np.log(1e-6))
            clocked(
                "holdfast compiled kernel",
                lambda: likelihood(
                    ground.distances, np.arange(d), ground.y, at, True, 1, out, none, -99.0, -np.inf
                ),
            )
        model = GaussianProcessRegressor(RBF(np.ones(d)), optimizer=None, alpha=1e-6).fit(x, y)
        theta = model.kernel_.theta
        clocked(
            "scikit-learn log_marginal_likelihood",
            lambda: model.log_marginal_likelihood(theta, eval_gradient=True, clone_kernel=False),
        )
