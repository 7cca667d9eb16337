"""Space-filling designs beside SMT, scipy, OpenTURNS and pyDOE3 in the same run: CPU seconds and quality.

Medians over seeds, one thread; the first call compiles and does not count. Our budgets are in swaps, set so
that a search takes about a second on one core; the seconds printed are those of this run.
"""

import resource
import statistics
import time
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import qmc

import doe

pytestmark = pytest.mark.bench

SEEDS = 20
SLOW_SEEDS = 2
# size -> swaps of phi_p, swaps of cd2: a third of a second to one second each, by machine
ONE_SECOND = {
    (50, 20): (1_500_000, 2_000_000),
    (64, 8): (1_500_000, 2_500_000),
    (100, 10): (1_200_000, 2_000_000),
    (500, 20): (150_000, 250_000),
}
GOALS = {
    (50, 20): (1.131, 0.895),
    (64, 8): (2.107, 0.0095),
    (100, 10): (2.033, 0.0132),
    (500, 20): (1.922, 0.069),
}
JOINT = (8.0, 2.0, 1.0)


def measure(make: Callable[[int], np.ndarray], seeds: int = SEEDS) -> tuple[float, list[np.ndarray]]:
    """Median CPU seconds of a call, and the designs."""
    make(1000)
    times, designs = [], []
    for seed in range(seeds):
        begin = time.process_time()
        designs.append(np.asarray(make(seed)))
        times.append(time.process_time() - begin)
    return statistics.median(times), designs


def median(metric: Callable[[np.ndarray], float], designs: list[np.ndarray]) -> float:
    return statistics.median(metric(points) for points in designs)


def row(case: str, method: str, seconds: float, shown: str, seeds: int) -> None:
    spent = f"{seconds * 1e3:9.3f} ms" if seconds < 1 else f"{seconds:9.2f} s "
    print(f"  {case:8s} {method:34s} {spent}   {shown}   ({seeds} seeds)", flush=True)


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def smt_ese(n: int, d: int, seed: int) -> np.ndarray:
    LHS = pytest.importorskip("smt.sampling_methods").LHS
    limits = np.array([[0.0, 1.0]] * d)
    try:
        return LHS(xlimits=limits, criterion="ese", seed=seed)(n)
    except Exception:  # the seed's name changed between releases
        return LHS(xlimits=limits, criterion="ese", random_state=seed)(n)


def random_cd(n: int, d: int, seed: int) -> np.ndarray:
    return qmc.LatinHypercube(d, optimization="random-cd", rng=rng(seed)).random(n)


def openturns_annealed(n: int, d: int, seed: int) -> np.ndarray:
    ot = pytest.importorskip("openturns")
    ot.RandomGenerator.SetSeed(seed)
    joint = getattr(ot, "JointDistribution", None) or ot.ComposedDistribution  # renamed in 1.23
    experiment = ot.LHSExperiment(joint([ot.Uniform(0.0, 1.0)] * d), n)
    experiment.setAlwaysShuffle(True)
    search = ot.SimulatedAnnealingLHS(
        experiment, ot.SpaceFillingPhiP(10), ot.GeometricProfile(10.0, 0.999, 10_000)
    )
    return np.asarray(search.generate())


def pydoe3_maximin(n: int, d: int, seed: int) -> np.ndarray:
    pyDOE3 = pytest.importorskip("pyDOE3")
    return pyDOE3.lhs(d, samples=n, criterion="centermaximin", iterations=1000, seed=seed)


@pytest.mark.parametrize("size", ONE_SECOND, ids=str)
def test_distance(size):
    n, d = size
    case = f"{n}x{d}"
    print()
    swaps, _ = ONE_SECOND[size]
    seeds = SEEDS if n < 500 else 10
    for label, count in (("ours, phi_p, 1 s", swaps), ("ours, phi_p, 1e4 swaps", 10_000)):
        seconds, found = measure(
            lambda s, count=count: doe.optimised_lhs(n, d, swaps=count, rng=rng(s)), seeds
        )
        phi, least = median(doe.phi_p, found), median(doe.min_distance, found)
        row(case, label, seconds, f"phi_10 {phi:.4f} (goal {GOALS[size][0]})  min d {least:.4f}", seeds)
    for label, make, seeds in (
        ("SMT ESE", smt_ese, SLOW_SEEDS),
        ("OpenTURNS annealed phi_p", openturns_annealed, SLOW_SEEDS),
        ("pyDOE3 centermaximin 1000", pydoe3_maximin, SLOW_SEEDS),
        ("scipy random LHS", lambda n, d, s: qmc.LatinHypercube(d, rng=rng(s)).random(n), SEEDS),
    ):
        if n >= 500 and make is openturns_annealed:
            continue  # minutes
        seconds, found = measure(lambda s, make=make: make(n, d, s), seeds)
        phi, least = median(doe.phi_p, found), median(doe.min_distance, found)
        row(case, label, seconds, f"phi_10 {phi:.4f}                min d {least:.4f}", seeds)


@pytest.mark.parametrize("size", ONE_SECOND, ids=str)
def test_discrepancy(size):
    n, d = size
    case = f"{n}x{d}"
    print()
    _, swaps = ONE_SECOND[size]
    seeds = SEEDS if n < 500 else 10
    for label, count in (("ours, cd2, 1 s", swaps), ("ours, cd2, 1e4 swaps", 10_000)):
        seconds, found = measure(
            lambda s, count=count: doe.optimised_lhs(n, d, criterion="cd2", swaps=count, rng=rng(s)), seeds
        )
        row(case, label, seconds, f"CD2 {median(doe.cd2, found):.5f} (goal {GOALS[size][1]})", seeds)
    seconds, found = measure(lambda s: random_cd(n, d, s), SLOW_SEEDS)
    row(case, "scipy random-cd", seconds, f"CD2 {median(doe.cd2, found):.5f}", SLOW_SEEDS)


@pytest.mark.parametrize("size", [(50, 20), (64, 8), (100, 10), (500, 20), (1000, 50)], ids=str)
def test_time_to_the_quality_of_the_peers(size):
    n, d = size
    case = f"{n}x{d}"
    print()
    for label, peer, criterion, metric in (
        ("SMT ESE", smt_ese, "phi_p", doe.phi_p),
        ("scipy random-cd", random_cd, "cd2", doe.cd2),
    ):
        if size == (1000, 50) and peer is smt_ese:
            seeds = 1  # minutes
        else:
            seeds = SLOW_SEEDS
        theirs, found = measure(lambda s, peer=peer: peer(n, d, s), seeds)
        wanted = median(metric, found)
        for swaps in (round(500 * 1.25**k) for k in range(27)):
            ours, found = measure(
                lambda s, criterion=criterion, swaps=swaps: doe.optimised_lhs(
                    n, d, criterion=criterion, swaps=swaps, rng=rng(s)
                ),
                3,
            )
            if median(metric, found) <= wanted:
                break
        reached = median(metric, found)
        shown = (
            f"{criterion} {reached:.5g} <= {wanted:.5g} of {label} in {theirs:.3g} s: 1/{theirs / ours:.0f}"
        )
        row(case, f"ours, {swaps} swaps", ours, shown, 3)


@pytest.mark.parametrize("size", [(64, 8), (100, 10), (500, 20)], ids=str)
def test_three_criteria_at_once(size):
    n, d = size
    print()
    alone = [
        median(
            metric,
            measure(
                lambda s, name=name, k=k: doe.optimised_lhs(n, d, criterion=name, swaps=k, rng=rng(s)), 5
            )[1],
        )
        for name, metric, k in zip(("phi_p", "cd2"), (doe.phi_p, doe.cd2), ONE_SECOND[size], strict=True)
    ]
    swaps = 16_000_000 if n < 500 else 2_000_000
    seconds, found = measure(
        lambda s: doe.optimised_lhs(
            n, d, criterion=("phi_p", "cd2", "correlation"), weights=JOINT, swaps=swaps, rng=rng(s)
        ),
        5,
    )
    phi, cd2 = median(doe.phi_p, found) / alone[0] - 1, median(doe.cd2, found) / alone[1] - 1
    shown = f"phi_10 {100 * phi:+.2f} % (2)  CD2 {100 * cd2:+.2f} % (5)"
    shown += f"  corr {median(doe.max_correlation, found):.4f} (0.01)"
    row(f"{n}x{d}", f"ours, weights {JOINT}", seconds, shown, 5)


def test_ihs():
    print()
    for n, d, goal in ((50, 20, 0.001), (500, 20, 0.3), (1000, 50, 2.0)):
        seconds, found = measure(lambda s, n=n, d=d: doe.ihs(n, d, rng=rng(s)), SEEDS if n < 1000 else 3)
        least = median(doe.min_distance, found)
        row(f"{n}x{d}", "ours, IHS as published", seconds, f"min d {least:.4f} (goal {goal} s)", len(found))
        seconds, found = measure(lambda s, n=n, d=d: doe.ihs(n, d, target="auto", rng=rng(s)), 3)
        row(f"{n}x{d}", "ours, IHS auto", seconds, f"min d {median(doe.min_distance, found):.4f}", 3)
    begin = time.process_time()
    doe.ihs(10_000, 100, pool=100, rng=rng(1))
    row("1e4x100", "ours, IHS, pool=100", time.process_time() - begin, "(goal 60 s)", 1)


def test_large_designs():
    print()
    doe.decorrelated_lhs(1_000, 10, rng=rng(0))
    doe.quality(doe.lhs(20_000, 8, rng=rng(0)), references=1, rng=rng(0))
    begin = time.process_time()
    points = doe.decorrelated_lhs(100_000, 100, rng=rng(1))
    design = time.process_time() - begin
    doe.quality(points, rng=rng(1))
    total = time.process_time() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    shown = (
        f"corr {doe.max_correlation(points):.1e} (goal 1e-5); with sampled quality {total:.1f} s (goal 10 s)"
    )
    row("1e5x100", "ours, decorrelated", design, f"{shown}, peak {peak:.2f} GB (goal 1.5)", 1)
    points = doe.lhs(10_000, 100, rng=rng(1))
    begin = time.process_time()
    value = doe.cd2(points)
    row("1e4x100", "ours, exact CD2", time.process_time() - begin, f"CD2 {value:.6g} (goal 3 s)", 1)
    begin = time.process_time()
    value = qmc.discrepancy(points)
    row("1e4x100", "scipy, exact CD2", time.process_time() - begin, f"CD2 {value:.6g}", 1)
