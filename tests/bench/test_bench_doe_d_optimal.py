"""D-optimal designs beside pydoe and pyDOE3, in the same run: CPU time of one core and D-efficiency."""

import statistics
import time
from collections.abc import Callable

import numpy as np
import pytest

import doe

pytestmark = pytest.mark.bench

SEEDS = 20


def row(case: str, method: str, seconds: float, efficiency: float, seeds: int) -> None:
    shown = f"{seconds * 1e3:10.2f} ms" if seconds < 1 else f"{seconds:10.2f} s "
    print(f"  {case:34s} {method:40s} {shown}   D = {100 * efficiency:6.3f} %   ({seeds} seeds)")


def measure(make: Callable[[np.random.Generator], np.ndarray], model: str, seeds: int) -> tuple[float, float]:
    """Median CPU seconds and D-efficiency; the first call compiles and does not count."""
    make(np.random.default_rng(1000))
    times, values = [], []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        begin = time.process_time()
        points = make(rng)
        times.append(time.process_time() - begin)
        values.append(doe.d_efficiency(points, model=model))
    return statistics.median(times), statistics.median(values)


def pool(size: int, d: int, seed: int) -> np.ndarray:
    return doe.lhs(size, d, rng=np.random.default_rng(seed))


def test_64_by_8_quadratic_from_640_candidates():
    print()
    case = "64x8 quadratic, 640 candidates"
    pools = [pool(640, 8, seed) for seed in range(SEEDS)]
    doe.exchange(pools[0], 64, rng=np.random.default_rng(0))
    for shakes in (0, None, 100):
        times, values = [], []
        for seed, candidates in enumerate(pools):
            begin = time.process_time()
            rows = doe.exchange(candidates, 64, shakes=shakes, rng=np.random.default_rng(seed))
            times.append(time.process_time() - begin)
            values.append(doe.d_efficiency(candidates[rows], model="quadratic"))
        name = "ours, exchange" + ("" if shakes is None else f", shakes={shakes}")
        row(case, name, statistics.median(times), statistics.median(values), SEEDS)
    found = measure(
        lambda rng: doe.d_optimal_select(64, 8, model="quadratic", pool=640, rng=rng), "quadratic", SEEDS
    )
    row(case, "ours, d_optimal_select with its pool", *found, SEEDS)
    optimal = pytest.importorskip("pydoe").optimal_design
    begin = time.process_time()
    theirs, _ = optimal(2 * pools[0] - 1, n_points=64, degree=2, criterion="D", method="fedorov", max_iter=50)
    row(
        case,
        "pydoe fedorov",
        time.process_time() - begin,
        doe.d_efficiency((theirs + 1) / 2, model="quadratic"),
        1,
    )


def test_large_candidate_lists():
    print()
    for n, d, size, seeds in ((100, 10, 100_000, 3), (500, 20, 5_000, 3)):
        times, values = [], []
        doe.exchange(pool(size, d, 99), n, rng=np.random.default_rng(0))
        for seed in range(seeds):
            candidates = pool(size, d, seed)
            begin = time.process_time()
            rows = doe.exchange(candidates, n, rng=np.random.default_rng(seed))
            times.append(time.process_time() - begin)
            values.append(doe.d_efficiency(candidates[rows], model="quadratic"))
        case = f"{n}x{d} quadratic, {size} candidates"
        row(case, "ours, exchange", statistics.median(times), statistics.median(values), seeds)


def test_readings_of_a_d_optimal_latin_hypercube():
    print()
    case = "50x20 linear"
    row(
        case,
        "ours, d_optimal_select, pool 1000",
        *measure(lambda r: doe.d_optimal_select(50, 20, rng=r), "linear", 10),
        10,
    )
    row(
        case,
        "ours, d_optimal_within, 1e5 swaps",
        *measure(lambda r: doe.d_optimal_within(50, 20, rng=r), "linear", 10),
        10,
    )
    row(
        case,
        "ours, d_optimal_best_of, 1000 tries",
        *measure(lambda r: doe.d_optimal_best_of(50, 20, rng=r), "linear", 5),
        5,
    )
    row(case, "ceiling of a Latin hypercube", 0.0, ((1 - 50.0**-2) / 3) ** (20 / 21), 0)


def test_coordinate_exchange():
    print()
    for n, d, model, levels in (
        (6, 2, "quadratic", None),
        (10, 3, "quadratic", None),
        (14, 3, "quadratic", 3),
        (12, 11, "linear", 2),
        (64, 8, "quadratic", 3),
        (50, 20, "linear", 2),
    ):
        found = measure(lambda r: doe.coordinate_exchange(n, d, model=model, levels=levels, rng=r), model, 5)  # noqa: B023
        row(f"{n}x{d} {model}", f"ours, coordinate_exchange, levels={levels}", *found, 5)


@pytest.mark.slow
def test_a_million_candidates_in_twenty_factors():
    print()
    candidates = pool(1_000_000, 20, 0)
    for n, model in ((60, "linear"), (300, "quadratic")):
        begin = time.process_time()
        rows = doe.exchange(candidates, n, model=model, rng=np.random.default_rng(0))
        seconds = time.process_time() - begin
        row(
            f"{n}x20 {model}, 1e6 candidates",
            "ours, exchange",
            seconds,
            doe.d_efficiency(candidates[rows], model=model),
            1,
        )
